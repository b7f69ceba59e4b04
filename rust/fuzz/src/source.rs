//! Bytes as a source of choices and numbers: zeros where they have run out.

pub struct Source<'a>(pub &'a [u8]);

impl Source<'_> {
    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// 0 to less than `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        usize::from(u16::from_le_bytes([self.byte(), self.byte()])) % limit.max(1)
    }

    /// −1 to 1.
    pub fn unit(&mut self) -> f64 {
        f64::from(i16::from_le_bytes([self.byte(), self.byte()])) / 32768.0
    }

    /// Mostly ordinary, now and then at the edges of the format or beyond.
    pub fn number(&mut self) -> f64 {
        match self.byte() {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => -f64::MAX,
            3 => 1e-310,
            4 => 1e38,
            5 => -1e20,
            6 => -0.0,
            7 => f64::from_le_bytes(std::array::from_fn(|_| self.byte())),
            kind => self.unit() * [0.01, 1.0, 1.0, 100.0][usize::from(kind % 4)],
        }
    }
}

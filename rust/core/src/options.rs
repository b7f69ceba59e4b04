//! Range checks of options. The messages are worded as those of the Python layer.

use crate::error::{Error, Result};

pub fn finite(name: &'static str, value: f64) -> Result<()> {
    expect(name, "a finite number", value, value.is_finite())
}

pub fn positive(name: &'static str, value: f64) -> Result<()> {
    finite(name, value)?;
    expect(name, "a positive number", value, value > 0.0)
}

pub fn not_negative(name: &'static str, value: f64) -> Result<()> {
    finite(name, value)?;
    expect(name, "zero or more", value, value >= 0.0)
}

fn expect(name: &'static str, expected: &str, value: f64, met: bool) -> Result<()> {
    if met {
        return Ok(());
    }
    Err(Error::Argument { name, expected: expected.into(), got: value.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_the_option_and_what_came() {
        assert_eq!(not_negative("gamma", -1.0).unwrap_err().to_string(), "gamma: expected zero or more, got -1");
        assert_eq!(positive("sigma", 0.0).unwrap_err().to_string(), "sigma: expected a positive number, got 0");
        assert_eq!(finite("alpha", f64::NAN).unwrap_err().to_string(), "alpha: expected a finite number, got NaN");
        assert!(positive("step", f64::INFINITY).is_err() && not_negative("alpha", 0.0).is_ok());
    }
}

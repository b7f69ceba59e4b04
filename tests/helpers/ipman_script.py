"""The command line as a script: Lightning starts its further processes by running the script again."""

from __future__ import annotations

from ipman_rs.cli import main

if __name__ == "__main__":
    main()

"""`python -m analyses.hidden_effects`."""

from .run import main

if __name__ == "__main__":
    raise SystemExit(main())

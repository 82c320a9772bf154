"""`python -m calibeam`: the same as the console command."""

from calibeam.cli import main

if __name__ == "__main__":
    main()

"""`python -m staniel` is `staniel`."""

from staniel.cli import main

if __name__ == "__main__":
    main()

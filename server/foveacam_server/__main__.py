"""`python -m foveacam_server` is `foveacam`."""

from foveacam_server.cli import main

if __name__ == "__main__":
    main()

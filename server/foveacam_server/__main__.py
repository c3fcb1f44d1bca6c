"""`python -m foveacam_server` is `foveacam`."""

from foveacam_server.program import main

if __name__ == "__main__":
    main()

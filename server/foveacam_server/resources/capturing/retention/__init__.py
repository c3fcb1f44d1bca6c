"""How long captures, recordings and stills are kept, and what goes to the trash then."""

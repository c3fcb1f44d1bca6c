"""How fast each mirror axis comes to rest."""

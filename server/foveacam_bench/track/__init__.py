"""How well moving targets are followed."""

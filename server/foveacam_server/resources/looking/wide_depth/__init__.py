"""What is known of the depth of the whole wide view."""

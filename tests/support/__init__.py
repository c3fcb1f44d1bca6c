"""What tests share: no tests stand here."""

"""Users, sign-ins, tokens of services and the audit log over REST."""

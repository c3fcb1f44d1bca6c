"""Authentication and authorization: users, sign-ins, tokens of services, rights, audit log."""

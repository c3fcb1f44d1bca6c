"""Who uses the server, and what each may do: users, sign-ins, tokens of services, rights, audit log."""

"""Requests and answers by HTTP: what they may hold, how they are made, where they go."""

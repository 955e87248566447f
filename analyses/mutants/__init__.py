"""Mutation testing of what decides: small mistakes put into a module, each of which the fast tests must notice."""

"""What README and docs say of the studies in ``docs/results``, a module a kind of study."""

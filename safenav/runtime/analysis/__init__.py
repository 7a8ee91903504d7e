"""Runs that have ended: against their expectations, why an operator is needed, resumed."""

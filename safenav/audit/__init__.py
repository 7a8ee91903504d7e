"""Trace reader and checker, independent of the program that wrote the trace."""

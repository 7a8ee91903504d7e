"""Families of specifications that others published, written anew at every size.

Reactive synthesizers are compared on these.  Each function gives structuredslugs text.
"""

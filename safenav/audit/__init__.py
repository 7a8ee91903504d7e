"""Reads traces and checks them, knowing nothing of the program that wrote them."""

"""Real robots: conversion between regions and metres, and the transports that drive them."""

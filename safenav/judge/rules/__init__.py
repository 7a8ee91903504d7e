"""Rules: generators over a line and the state before it takes effect. Each yields what is wrong."""

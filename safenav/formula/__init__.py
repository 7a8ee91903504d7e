"""The structured-slugs expression language: syntax tree, parser, printer, checks, evaluator."""

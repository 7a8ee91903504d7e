"""Analysis of runs: expectations, reasons why an operator is needed, resumption."""

"""The laboratory: charts, stability suites, rigs and training. In the repository, in no wheel."""

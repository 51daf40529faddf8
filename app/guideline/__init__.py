"""The guideline reviewers grade by, with drawn examples, and judged poses to practise on."""

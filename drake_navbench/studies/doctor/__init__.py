"""The doctor: from a Nav2 file and a symptom to a change that is shown to help."""

"""The critics of DWB, one small class each; base.py says what a critic is and how to add one."""

"""The critics of DWB, one small class each; base.py defines critics and shows how to add one."""

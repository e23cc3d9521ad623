class LearnedPolicy: pass

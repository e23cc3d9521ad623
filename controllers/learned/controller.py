class LearnedPolicy:
    pass

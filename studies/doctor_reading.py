"""Where does the doctor's reading lose, and which other way of ranking its causes gains?

    python studies/doctor_reading.py loss --files FOLDER      the table of losses, list by list

`loss` puts each case of the lists in `doctor_cases/` into one row: the cure is the first cause, the
second or third, the fourth to twelfth, later; it is among the causes in the other direction alone;
or it is not among them. Beside it, whether the class of the user's words is the right one, and the
score if the doctor takes that class. FOLDER is made by `doctor_cases.py files`.

The rules, written before another way of ranking was scored:

- Cases that count: `fresh_three` to `fresh_six` (93), from which no rule of the doctor was learnt.
  A way that has numbers to fit is fitted on cases of other owners alone (leave one owner out, all
  lists; each thread of a host of many users is an owner of its own). Its form, its penalty and the
  numbers of its features are chosen on the folds of other owners, never by the score that
  counts; where that is not done, the number of forms looked at is told.
- The unit of the test is the owner, by the sum of its cases. A way gains if the first place is
  gained by more owners than lose it with p at most 0.05 (exact sign test, one-sided), or if it has
  at least 8 points more of the cases first; in both cases among three it may not be worse.
- A part is deleted if without it the 93 cases have at least as many first and among three, less
  one each, and the 193 cases of the other lists lose at most 2% first.
- Of two ways that gain, the one with fewer parts is taken if its score is at most two cases less.
- A way that gains is read once on a fresh list of owners on no list. It stays if it has there at
  least as many cures first as the old one.
"""

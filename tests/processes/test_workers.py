"""Tasks in processes of their own: whatever happens there, the caller learns it and goes on."""

import math
import os
import signal
import subprocess
import sys
import textwrap
import time
from contextlib import closing

import pytest

from drake_navbench.errors import InputError
from drake_navbench.processes import worker, workers
from drake_navbench.processes.tasks import Died, NoWorkers, Task, TimedOut
from drake_navbench.processes.waiting_tasks import WaitingTasks
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import run_tasks

pytestmark = pytest.mark.usefixtures("real_workers")


def endings(*tasks: Task, jobs: int = 1, **options) -> list:
    """Returns how tasks ended, in their order."""
    ended = {id(task): ending for task, ending in run_tasks(tasks, jobs=jobs, **options)}
    return [ended[id(task)] for task in tasks]


def is_running(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(condition) -> None:
    while not condition():
        time.sleep(0.01)


def test_a_task_returns_what_its_function_returns():
    first, second = endings(Task(math.sqrt, (4.0,)), Task(math.sqrt, (9.0,)), jobs=2)
    assert first == Returned(2.0)
    assert second == Returned(3.0)


def fail_on_input() -> None:
    raise InputError("a line for the user")


def fail_with(error: BaseException) -> None:
    raise error


def test_what_a_task_raises_is_told_and_its_worker_goes_on():
    wrong, broken, interrupted, after = endings(
        Task(fail_on_input, ()),
        Task(fail_with, (ZeroDivisionError("by nought"),)),
        Task(fail_with, (KeyboardInterrupt(),)),
        Task(math.sqrt, (4.0,)),
    )
    assert isinstance(wrong, Raised)
    assert type(wrong.error) is InputError
    assert str(wrong.error) == "a line for the user"
    assert str(broken.error) == "ZeroDivisionError: by nought"
    assert "fail_with" in broken.error.details
    assert str(interrupted.error) == "KeyboardInterrupt"
    assert after == Returned(2.0)


def returns_what_cannot_be_sent():
    return lambda: None


def test_what_cannot_be_sent_back_is_a_fault_of_the_task():
    (ending,) = endings(Task(returns_what_cannot_be_sent, ()))
    assert "returns_what_cannot_be_sent.<locals>.<lambda>" in str(ending.error)


@pytest.mark.parametrize("code", [0, 1, 255])
def test_a_task_that_leaves_its_process_is_known_at_once(code):
    left, after = endings(Task(os._exit, (code,)), Task(math.sqrt, (4.0,)))
    assert left == Died(f"the worker process died with exit code {code}", is_from_outside=False)
    assert after == Returned(2.0)


def end_by(number: int) -> None:
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
    signal.pause()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_kill_is_told_from_what_a_task_does(number):
    (ending,) = endings(Task(_sleep_killed_by, (number,)))
    assert ending.is_from_outside
    assert f"signal {int(number)}" in ending.sentence


def _sleep_killed_by(number: int) -> None:
    subprocess.Popen([sys.executable, "-c", f"import os; os.kill({os.getpid()}, {int(number)})"])
    signal.pause()


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGABRT, signal.SIGALRM])
def test_a_crash_is_what_the_task_did(number):
    (ending,) = endings(Task(end_by, (number,)))
    assert not ending.is_from_outside


def test_a_task_that_takes_too_long_is_ended():
    late, after = endings(Task(signal.pause, (), time_limit_s=0.2), Task(math.sqrt, (4.0,)))
    assert late == TimedOut(0.2)
    assert after == Returned(2.0)


def close_everything() -> None:
    os.closerange(3, 100)


def test_a_task_that_closes_the_pipe_ends_only_itself():
    closed, after = endings(Task(close_everything, ()), Task(math.sqrt, (4.0,)))
    assert isinstance(closed, Died)
    assert not closed.is_from_outside
    assert after == Returned(2.0)


def test_a_worker_serves_one_owner_and_is_renewed_for_the_next():
    owners = ["", "theirs", "", "others", "theirs"]
    tasks = [Task(os.getpid, (), owner=owner) for owner in owners]
    pids = [ending.value for ending in endings(*tasks)]
    assert pids[0] == pids[2]
    assert pids[1] == pids[4]
    assert len(set(pids)) == 3


def test_a_worker_is_replaced_after_its_share_of_tasks():
    pids = [e.value for e in endings(*[Task(os.getpid, ()) for _ in range(4)], tasks_per_worker=2)]
    assert pids[0] == pids[1] != pids[2] == pids[3]


def die_before_the_first_task(connection, variables) -> None:
    os._exit(7)


def test_workers_that_die_before_their_first_task_are_replaced_three_times(monkeypatch):
    monkeypatch.setattr(worker, "serve", die_before_the_first_task)
    with pytest.raises(NoWorkers) as caught:
        endings(Task(math.sqrt, (4.0,)))
    assert str(caught.value) == (
        "workers cannot be started, 3 in a row failed: the worker process died with exit code 7"
    )


def test_a_start_that_fails_twice_is_forgotten_when_one_succeeds(monkeypatch):
    served = worker.serve
    plan = [die_before_the_first_task] * 2 + [served] + [die_before_the_first_task] * 2 + [served]
    plan = iter(plan)
    real = workers.Worker

    def start(task):
        monkeypatch.setattr(worker, "serve", next(plan))
        return real(task)

    monkeypatch.setattr(workers, "Worker", start)
    done = endings(Task(math.sqrt, (4.0,), owner="a"), Task(math.sqrt, (9.0,), owner="b"))
    assert done == [Returned(2.0), Returned(3.0)]


def test_an_exception_ends_the_workers_without_waiting_for_them():
    pids = []
    with closing(run_tasks([Task(os.getpid, ()), Task(signal.pause, ())], jobs=1)) as running:
        _, ending = next(running)
        pids.append(ending.value)
    wait_until(lambda: not is_running(pids[0]))
    assert not is_running(pids[0])


ORPHANS = """
import sys, os, signal
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.workers import run_tasks

def tell(): pass

for task, ending in run_tasks([Task(os.getpid, ()), Task(signal.pause, ())], jobs=1):
    print(ending.value, flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_workers_do_not_outlive_their_caller(number):
    with subprocess.Popen(
        [sys.executable, "-c", ORPHANS], stdout=subprocess.PIPE, text=True
    ) as caller:
        pid = int(caller.stdout.readline())
        assert is_running(pid)
        caller.send_signal(number)
    wait_until(lambda: not is_running(pid))


SCRIPT = """
import os, sys
print("here")
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.workers import run_tasks
for task, ending in run_tasks([Task(abs, (-3,)), Task(abs, (-4,))], jobs=2):
    print(ending.value)
"""


@pytest.mark.parametrize("how", ["file", "standard input"])
def test_a_script_needs_no_main_guard(how, tmp_path):
    (tmp_path / "script.py").write_text(textwrap.dedent(SCRIPT))
    arguments = ["script.py"] if how == "file" else ["-"]
    with (tmp_path / "script.py").open() as source:
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=tmp_path,
            stdin=source,
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.stderr == ""
    assert sorted(done.stdout.split()) == ["3", "4", "here"]


def test_one_of_each_kind_is_begun_first_and_then_the_longest():
    def naps(kind, duration_s):
        return [Task(time.sleep, (duration_s,), kind=kind) for _ in range(3)]

    short, long, middling = naps("short", 0.0), naps("long", 0.2), naps("middling", 0.1)
    tasks = [*short, *long, *middling]
    begun = [task.kind for task, _ in run_tasks(tasks, jobs=1)]
    assert begun == ["short", "long", "middling"] + ["long"] * 2 + ["middling"] * 2 + ["short"] * 2


def test_tasks_of_one_kind_keep_their_order():
    tasks = [Task(math.sqrt, (float(k),)) for k in range(4)]
    assert [task for task, _ in run_tasks(tasks, jobs=1)] == tasks


def test_a_task_begins_when_those_that_it_waits_for_have_ended_however():
    first = Task(time.sleep, (0.3,), kind="first")
    broken = Task(fail_on_input, (), kind="broken")
    last = Task(math.sqrt, (4.0,), kind="last", after=(first, broken))
    alone = Task(math.sqrt, (9.0,), kind="alone", after=(Task(time.sleep, (0.0,)),))
    tasks = [last, first, broken, alone]
    for jobs in (1, 2, 3):
        ended = [task.kind for task, _ in run_tasks(tasks, jobs=jobs)]
        assert sorted(ended) == ["alone", "broken", "first", "last"]
        assert ended.index("last") > max(ended.index("first"), ended.index("broken"))


def test_a_worker_whose_tasks_wait_for_another_stays():
    """Its kernels are read and its columns rehearsed."""
    slow = Task(time.sleep, (0.5,), kind="slow")
    quick = Task(os.getpid, (), kind="quick")
    later = [Task(os.getpid, (), kind=f"later {k}", after=(slow,)) for k in range(2)]
    ended = dict(run_tasks([slow, quick, *later], jobs=2))
    assert ended[quick].value in {ended[task].value for task in later}


def test_a_worker_that_dies_between_two_tasks_ends_none_of_them_again():
    slow = Task(time.sleep, (0.5,), kind="slow")
    quick = Task(os.getpid, (), kind="quick")
    later = Task(os.getpid, (), kind="later", after=(slow,))
    ended = []
    for task, ending in run_tasks([slow, quick, later], jobs=2):
        ended.append((task.kind, type(ending)))
        if task is quick:
            os.kill(ending.value, signal.SIGKILL)
    assert ended == [("quick", Returned), ("slow", Returned), ("later", Returned)]


def test_what_waits_for_a_task_of_another_owner_does_not_keep_its_worker_from_it():
    ours = Task(math.sqrt, (4.0,), kind="ours")
    theirs = [
        Task(math.sqrt, (9.0,), owner="them", kind="begins", is_urgent=True),
        Task(math.sqrt, (16.0,), owner="them", kind="waits", after=(ours,)),
    ]
    assert [end.value for _, end in run_tasks([*theirs, ours], jobs=1)] == [3.0, 2.0, 4.0]


def test_urgent_tasks_come_before_kinds_that_nobody_has_timed():
    urgent = [Task(math.sqrt, (4.0,), kind="urgent", is_urgent=True) for _ in range(2)]
    other = Task(math.sqrt, (9.0,), kind="other")
    assert [task for task, _ in run_tasks([other, *urgent], jobs=1)] == [*urgent, other]


def test_the_next_task_is_found_as_quickly_among_many(monkeypatch):
    """Counted in looks at tasks: a campaign of 100,000 trials waits for its workers alone."""
    looks = []
    urgency = WaitingTasks._urgency
    monkeypatch.setattr(
        WaitingTasks, "_urgency", lambda self, task: looks.append(task) or urgency(self, task)
    )
    kinds = ("short", "long", "middling")
    waiting = WaitingTasks([Task(time.sleep, (0.0,), kind=kinds[k % 3]) for k in range(3000)])
    taken = [waiting.take("") for _ in range(3000)]
    assert len(looks) <= 3 * 3000
    assert None not in taken
    assert waiting.take("") is None
    assert not waiting

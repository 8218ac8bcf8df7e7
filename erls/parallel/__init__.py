"""Worker processes, and how work is shared out among them.

Why not a library. A batch must not run the caller's script again, which has no ``if __name__ == "__main__"``; a worker
that dies may cost the task that it was at and no other; an interrupt brings back what every worker has computed so far;
and the caller works too, so that workers come only where enough is left for them.

- ``concurrent.futures`` runs the script again in each new worker ("spawn": an unguarded one ends in BrokenProcessPool),
  or copies a process that holds threads and compiled code ("fork"). One worker that dies fails every task that waits,
  those that ran in others too. A task that has begun cannot be told to end and hand over what it has.
- loky leaves the script alone, keeps idle workers and heals its pool, but fails all tasks with the worker that died,
  knows no end of a task but killing it, and would be one more dependency. Sharing tasks with the caller, stopping them
  and giving them out again would remain to be written around it: most of what stands here.

`crew` is the bookkeeping of tasks, `workers` where processes come from and go, `worker_process` what runs in them.
"""

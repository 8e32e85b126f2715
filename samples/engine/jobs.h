/* The program's job system: a small pool of threads. nifkit does not know or need it. */
#ifndef ENGINE_JOBS_H
#define ENGINE_JOBS_H

typedef struct Jobs Jobs;
typedef void (*Job)(void* argument, int index);

/* A pool that runs on `threads` threads, including the caller's; null if there is no memory or no thread. */
Jobs* jobs_start(int threads);
/* Calls job(argument, i) once for each i in 0 .. count - 1, and returns when all have run. */
void jobs_run(Jobs* jobs, Job job, void* argument, int count);
/* Null is allowed. */
void jobs_stop(Jobs* jobs);

#endif

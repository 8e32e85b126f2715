/* The program's own job system: a small pool of threads. nifkit neither knows nor needs it. */
#ifndef ENGINE_JOBS_H
#define ENGINE_JOBS_H

typedef struct Jobs Jobs;
typedef void (*Job)(void* argument, int index);

/* A pool that runs on `threads` threads, the caller's included; null where there is no memory or no thread.
 */
Jobs* jobs_start(int threads);
/* Calls job(argument, i) once for each i in 0 .. count - 1, and returns when all have run. */
void jobs_run(Jobs* jobs, Job job, void* argument, int count);
/* Null is fine. */
void jobs_stop(Jobs* jobs);

#endif

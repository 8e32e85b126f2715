/* A thread pool with one mutex and two condition variables. The caller takes jobs, too, and then waits
 * for those that are still running. */
#define _POSIX_C_SOURCE 200809L
#include "jobs.h"

#include <pthread.h>
#include <stdlib.h>

struct Jobs {
  pthread_mutex_t mutex;
  pthread_cond_t work, done;
  Job job;
  void* argument;
  int next, count; /* jobs not yet taken: next .. count - 1 */
  int running;
  int stop;
  int threads;
  pthread_t thread[1]; /* [threads], all but the caller's */
};

/* With the mutex held: takes and runs jobs until none is left to take. */
static void take_all(Jobs* jobs) {
  while (jobs->next < jobs->count) {
    int index = jobs->next++;
    ++jobs->running;
    pthread_mutex_unlock(&jobs->mutex);
    jobs->job(jobs->argument, index);
    pthread_mutex_lock(&jobs->mutex);
    --jobs->running;
  }
  if (jobs->running == 0) pthread_cond_broadcast(&jobs->done);
}

static void* work(void* argument) {
  Jobs* jobs = argument;
  pthread_mutex_lock(&jobs->mutex);
  while (!jobs->stop) {
    take_all(jobs);
    while (!jobs->stop && jobs->next >= jobs->count) pthread_cond_wait(&jobs->work, &jobs->mutex);
  }
  pthread_mutex_unlock(&jobs->mutex);
  return NULL;
}

Jobs* jobs_start(int threads) {
  Jobs* jobs = calloc(1, sizeof(Jobs) + (size_t)threads * sizeof(pthread_t));
  if (jobs == NULL) return NULL;
  pthread_mutex_init(&jobs->mutex, NULL);
  pthread_cond_init(&jobs->work, NULL);
  pthread_cond_init(&jobs->done, NULL);
  for (; jobs->threads < threads - 1; ++jobs->threads) {
    if (pthread_create(&jobs->thread[jobs->threads], NULL, work, jobs) != 0) {
      jobs_stop(jobs);
      return NULL;
    }
  }
  return jobs;
}

void jobs_run(Jobs* jobs, Job job, void* argument, int count) {
  pthread_mutex_lock(&jobs->mutex);
  jobs->job = job;
  jobs->argument = argument;
  jobs->next = 0;
  jobs->count = count;
  pthread_cond_broadcast(&jobs->work);
  take_all(jobs);
  while (jobs->running > 0) pthread_cond_wait(&jobs->done, &jobs->mutex);
  pthread_mutex_unlock(&jobs->mutex);
}

void jobs_stop(Jobs* jobs) {
  int i;
  if (jobs == NULL) return;
  pthread_mutex_lock(&jobs->mutex);
  jobs->stop = 1;
  pthread_cond_broadcast(&jobs->work);
  pthread_mutex_unlock(&jobs->mutex);
  for (i = 0; i < jobs->threads; ++i) pthread_join(jobs->thread[i], NULL);
  pthread_cond_destroy(&jobs->done);
  pthread_cond_destroy(&jobs->work);
  pthread_mutex_destroy(&jobs->mutex);
  free(jobs);
}

// SPDX-License-Identifier: Apache-2.0
#include "interruption.h"

#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "shell.h"

namespace asbuilt::cli {

std::stop_token watch_for_interruption() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  std::stop_source source;
  const std::stop_token token = source.get_token();
  // A thread that waits may do anything, which a signal handler may not.
  std::thread([signals, source]() mutable {
    int signal = 0;
    sigwait(&signals, &signal);
    source.request_stop();
    sigwait(&signals, &signal);
    _exit(kInterrupted);
  }).detach();
  return token;
}

}  // namespace asbuilt::cli

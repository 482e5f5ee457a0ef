// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

#include "live_scenes.h"

extern char** environ;

namespace asbuilt::test {
namespace {

/// `asbuilt live` as a program of its own.
class Program {
 public:
  Program(const std::string& model, const fs::path& watched, const fs::path& output) {
    std::vector<std::string> words{
        ASBUILT_PROGRAM, "live", model, "--watch", watched.string(), "-o", output.string(), "--port", "0",
        "--threads",     "2",    "-q"};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    EXPECT_EQ(::posix_spawn(&id_, ASBUILT_PROGRAM, nullptr, nullptr, arguments.data(), environ), 0);
  }
  ~Program() { end(SIGKILL); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  int end(int signal) {
    if (id_ <= 0) return 0;
    int status = 0;
    ::kill(id_, signal);
    ::waitpid(id_, &status, 0);
    id_ = 0;
    return status;
  }

 private:
  pid_t id_ = 0;
};

TEST_F(LiveScenes, KilledAtAnyMomentItGoesOnAndEndsWithTheSameBytes) {
  const char* wanted = std::getenv("ASBUILT_LIVE_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : 4;
  const int scans = wanted != nullptr ? 10 : 3;
  simulate_scenes(scans, 31);
  const unsigned seed = 5;
  std::mt19937 random(seed);
  std::size_t given = 0;
  for (int i = 0; i < kills; ++i) {
    Program program(model(), watched(), output());
    // Scans come in while it runs; the last of them after the last kill.
    while (given + 1 < names_.size() &&
           given * static_cast<std::size_t>(kills) <= names_.size() * static_cast<std::size_t>(i)) {
      put(names_[given++]);
    }
    // From before the model is read to the joint refinement: the moment matters, not how long it takes.
    std::this_thread::sleep_for(std::chrono::milliseconds(std::uniform_int_distribution<int>(50, 4500)(random)));
    program.end(SIGKILL);
  }
  const auto all_stored = [&] {
    return std::ranges::all_of(
        names_, [&](const std::string& name) { return fs::exists(output() / "scans" / name / "live.json"); });
  };
  Program program(model(), watched(), output());
  while (given < names_.size()) put(names_[given++]);  // the last one: once it is stored, the program is up
  for (int i = 0; i < 6000 && !all_stored(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ASSERT_TRUE(all_stored());
  const int status = program.end(SIGINT);
  EXPECT_TRUE(WIFEXITED(status)) << status;
  reconstruct(base_ / "reference");
  EXPECT_EQ(content(output() / "result"), content(base_ / "reference")) << "seed " << seed;
}

}  // namespace
}  // namespace asbuilt::test

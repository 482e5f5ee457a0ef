// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "live_scenes.h"
#include "watch_loop.h"

// After everything that includes Eigen: <resolv.h>, which this brings, has a macro named _res.
#include <httplib.h>

namespace asbuilt::viewer {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

class LiveServer : public test::LiveScenes {
 protected:
  void start(const std::string& token = {}) {
    session_ = live::LiveSession::open(model(), {}, output(), false, Context(2)).value();
    thread_ = std::jthread([this, token](std::stop_token stop) {
      WatchOptions options;
      options.watch = watched();
      options.server.port = 0;
      options.server.token = token;
      options.server.largest_upload = 8U << 20U;
      WatchReports reports;
      reports.started = [this](const Server& server) {
        const std::lock_guard lock(mutex_);
        port_ = server.port();
        changed_.notify_all();
      };
      const auto done = run_watch(*session_, options, reports, stop);
      EXPECT_TRUE(done.has_value()) << done.error().message;
    });
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::minutes(5), [&] { return port_ != 0; });
    ASSERT_NE(port_, 0);
  }
  ~LiveServer() override {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }

  [[nodiscard]] httplib::Client client() const {
    httplib::Client client("127.0.0.1", port_);
    client.set_read_timeout(120);
    return client;
  }
  [[nodiscard]] Json state() const { return Json::parse(client().Get("/state")->body); }

  /// What is answered to a request of which nothing but the head is ever sent.
  [[nodiscard]] std::string answer_to_head(const std::string& head) const {
    const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{20, 0};  // the server gives up on a body after 30 s
    ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::send(connection, head.data(), head.size(), MSG_NOSIGNAL), static_cast<ssize_t>(head.size()));
    std::array<char, 64> answer{};
    const ssize_t got = ::recv(connection, answer.data(), answer.size(), 0);
    ::close(connection);
    return {answer.data(), got > 0 ? static_cast<std::size_t>(got) : 0};
  }

  /// Waits for a state that will do, however long a loaded machine takes.
  template <class Wanted>
  [[nodiscard]] Json until(const Wanted& wanted) const {
    Json now;
    for (int i = 0; i < 3000; ++i) {
      now = state();
      if (wanted(now)) return now;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << "never came: " << now.dump(1);
    return now;
  }

  std::unique_ptr<live::LiveSession> session_;
  std::jthread thread_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int port_ = 0;
};

TEST_F(LiveServer, DrivesAWholeSession) {
  simulate_scenes(3, 41);
  start();
  EXPECT_EQ(state()["phase"], "waiting");
  EXPECT_EQ(state()["now"]["level"], "act");
  const Json surface = Json::parse(client().Get("/surface")->body);
  put(names_[0]);
  const std::string second = io::read_file(base_ / "scenes" / names_[1]).value();
  const auto posted = client().Post("/scans?name=" + names_[1], second, "application/octet-stream");
  ASSERT_TRUE(posted);
  EXPECT_EQ(posted->status, 202) << posted->body;
  const Json two = until([](const Json& now) { return now["scans"].size() == 2 && now["phase"] == "waiting"; });
  EXPECT_GT(two["coverage"]["percent"].get<double>(), 5.0);
  EXPECT_FALSE(two["views"].empty());
  const Json values = Json::parse(client().Get("/surface/values?revision=1")->body);
  EXPECT_EQ(values["support"]["count"].get<int>() * 3, surface["vertices"]["count"].get<int>());
  const Json refined = until([](const Json& now) { return now["refinement"]["state"] == "done"; });
  EXPECT_EQ(refined["scans"].size(), 2U);

  EXPECT_EQ(client().Delete("/scans/" + names_[0])->status, 202);
  const Json one = until([](const Json& now) { return now["scans"].size() == 1; });
  EXPECT_THAT(one["removed"].dump(), testing::HasSubstr(names_[0]));
  EXPECT_EQ(client().Delete("/scans/absent.ply")->status, 404);
  EXPECT_EQ(client().Post("/scans/" + names_[0] + "/restore", "", "text/plain")->status, 202);
  (void)until([](const Json& now) { return now["scans"].size() == 2; });
  fs::remove(watched() / names_[1]);
  (void)until([](const Json& now) { return now["scans"].size() == 1; });

  EXPECT_EQ(client().Post("/result", "", "text/plain")->status, 202);
  (void)until([](const Json& now) { return now["result"]["state"] == "done"; });
  EXPECT_TRUE(fs::exists(output() / "result" / "result.json"));
}

TEST_F(LiveServer, EventsBringThePresentStateAtOnceAndEachChange) {
  simulate_scenes(1, 42);
  start();
  std::string text;
  int states = 0;
  httplib::Client events("127.0.0.1", port_);
  events.set_read_timeout(300);
  std::jthread putting([this] { put(names_[0]); });
  (void)events.Get("/events", [&](const char* data, std::size_t size) {
    text.append(data, size);
    states = 0;
    for (std::size_t at = 0; (at = text.find("event: state\n", at)) != std::string::npos; ++at) ++states;
    return text.find("\"arrival\":0") == std::string::npos;
  });
  EXPECT_GE(states, 2);
  EXPECT_TRUE(text.starts_with("event: state\nid: ")) << text.substr(0, 100);
}

TEST_F(LiveServer, HostileRequestsAreRefusedAndTheSessionLives) {
  simulate_scenes(1, 43);
  start();
  const auto status = [](const httplib::Result& result) { return result ? result->status : -1; };
  for (const char* name : {"..%2Fa.ply", "%2Fetc%2Fpasswd.ply", ".hidden.ply", "a.exe", "", "a%00.ply", "a%0a.ply"}) {
    EXPECT_EQ(status(client().Post(std::string("/scans?name=") + name, "x", "application/octet-stream")), 400) << name;
  }
  EXPECT_EQ(status(client().Post("/scans", "x", "application/octet-stream")), 400);
  EXPECT_EQ(status(client().Post("/scans?name=a.ply", "", "application/octet-stream")), 400);
  EXPECT_EQ(status(client().Get("/../../etc/passwd")), 404);
  EXPECT_EQ(status(client().Delete("/scans/..%2F..%2Fa.ply")), 404);
  EXPECT_EQ(status(client().Get("/state", {{"Host", "evil.example"}})), 403);
  EXPECT_EQ(status(client().Post("/result", {{"Origin", "http://evil.example"}}, "", "text/plain")), 403);
  const std::string huge(9U << 20U, 'x');
  const int refused = status(client().Post("/scans?name=huge.ply", huge, "application/octet-stream"));
  EXPECT_TRUE(refused == 413 || refused == -1) << refused;  // or the connection is closed while it is still sent
  fs::create_directory(watched() / "taken.ply");
  const auto over_a_folder = client().Post("/scans?name=taken.ply", "x", "application/octet-stream");
  EXPECT_EQ(status(over_a_folder), 500);
  EXPECT_THAT(over_a_folder->body, testing::HasSubstr("taken.ply could not be stored: Is a directory"));
  fs::remove(watched() / "taken.ply");
  // One that says so is not read to its end, which may never come.
  EXPECT_THAT(
      answer_to_head("POST /scans?name=huge.ply HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n"),
      testing::StartsWith("HTTP/1.1 413"));
  EXPECT_TRUE(fs::is_empty(watched()));
  EXPECT_EQ(status(client().Get("/state")), 200);
}

TEST_F(LiveServer, WithATokenNothingIsToldWithoutIt) {
  simulate_scenes(1, 44);
  start("secret");
  for (const char* path : {"/", "/state", "/surface", "/surface/values", "/events"}) {
    EXPECT_EQ(client().Get(path)->status, 401) << path;
  }
  EXPECT_EQ(client().Get("/state?token=secret")->status, 200);
  EXPECT_EQ(client().Get("/state", {{"Authorization", "Bearer secret"}})->status, 200);
}

TEST_F(LiveServer, WhatCannotBeStoredIsToldAndStoredByItselfOnceItCan) {
  simulate_scenes(1, 46);
  start();
  fs::copy_file(base_ / "scenes" / names_[0], base_ / "coming");
  std::optional<test::FullDisk> full(std::in_place);
  fs::rename(base_ / "coming", watched() / names_[0]);
  const Json waiting = until([](const Json& now) { return now["now"]["level"] == "bad"; });
  full.reset();
  EXPECT_THAT(waiting["now"]["headline"].get<std::string>(), testing::HasSubstr(names_[0] + " waits"));
  EXPECT_TRUE(waiting["scans"].empty());
  const Json stored = until([](const Json& now) { return now["scans"].size() == 1 && now["now"]["level"] != "bad"; });
  EXPECT_EQ(stored["scans"][0]["status"], "accepted");
  EXPECT_EQ(stored["notes"].back()["level"], "info");
}

TEST_F(LiveServer, ATakenPortIsToldByItsNumber) {
  simulate_scenes(1, 45);
  start();
  ServerOptions options;
  options.port = port_;
  const auto second = Server::start(content_of(*session_), watched(), options, {});
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::unwritable_output);
  EXPECT_THAT(second.error().message, testing::HasSubstr(std::to_string(port_)));
}

}  // namespace
}  // namespace asbuilt::viewer

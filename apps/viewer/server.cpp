// SPDX-License-Identifier: Apache-2.0
#include "server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>
#include <utility>

#include "asbuilt/web/pages.h"
#include "request_check.h"

namespace asbuilt::viewer {
namespace {

namespace fs = std::filesystem;

constexpr int kMostListeners = 24;  // each holds a thread
constexpr const char* kJson = "application/json";

void answer(httplib::Response& response, int status, std::string_view reason) {
  response.status = status;
  response.set_content(nlohmann::json{{"error", reason}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                       kJson);
}

/// A file on its way into the watched folder: hidden until it is whole.
class Upload {
 public:
  Upload(const fs::path& folder, const std::string& file)
      : place_(folder / file), temporary_(folder / fmt::format(".{}.{}.upload", file.substr(0, 180), next_++)) {
    stream_ = std::fopen(temporary_.c_str(), "wbx");
    if (stream_ == nullptr) fail_with(errno);
  }
  ~Upload() {
    if (stream_ != nullptr) std::fclose(stream_);
    std::error_code ignored;
    if (!done_) fs::remove(temporary_, ignored);
  }
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  bool append(const char* data, std::size_t size) {
    if (!failure_ && std::fwrite(data, 1, size, stream_) != size) fail_with(errno);
    bytes_ += size;
    return !failure_;
  }
  bool finish() {
    if (failure_) return false;
    if (std::fflush(stream_) != 0 || ::fsync(::fileno(stream_)) != 0) return fail_with(errno);
    const bool closed = std::fclose(std::exchange(stream_, nullptr)) == 0;
    if (!closed) return fail_with(errno);
    fs::rename(temporary_, place_, failure_);
    done_ = !failure_;
    return done_;
  }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] const std::error_code& failure() const { return failure_; }

 private:
  bool fail_with(int number) {
    failure_ = {number, std::generic_category()};
    return false;
  }

  static inline std::atomic<unsigned> next_ = 0;
  fs::path place_, temporary_;
  std::FILE* stream_ = nullptr;
  std::uint64_t bytes_ = 0;
  std::error_code failure_;
  bool done_ = false;
};

}  // namespace

struct Server::Implementation {
  Implementation(Content shown, fs::path folder, ServerOptions chosen, Requests what)
      : content(std::move(shown)), watched(std::move(folder)), options(std::move(chosen)), requests(std::move(what)) {}

  Content content;
  fs::path watched;
  ServerOptions options;
  Requests requests;
  AccessRules rules;
  httplib::Server http;
  std::thread thread;
  std::mutex mutex;
  std::condition_variable changed;
  std::uint64_t ticks = 0;
  bool stopping = false;
  std::atomic<int> listeners = 0;

  void guard() {
    http.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      const RequestHead head{request.get_header_value("Host"), request.get_header_value("Origin"),
                             request.get_header_value("Authorization"),
                             request.has_param("token") ? request.get_param_value("token") : std::string()};
      response.set_header("Cache-Control", "no-store");
      response.set_header("X-Content-Type-Options", "nosniff");
      response.set_header("X-Frame-Options", "DENY");
      response.set_header("Referrer-Policy", "no-referrer");
      const auto refused = refusal_of(head, rules);
      if (!refused) return httplib::Server::HandlerResponse::Unhandled;
      answer(response, refused->status, refused->reason);
      return httplib::Server::HandlerResponse::Handled;
    });
    http.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
      if (!response.body.empty()) return;
      const int status = response.status;
      if (status == 400 && request.method == "POST" && !request.has_header("Content-Length")) {
        return answer(response, status, "a POST needs its Content-Length, be it 0");
      }
      answer(response, status,
             status == 404   ? "there is nothing under this name (docs/live-protocol.md lists what there is)"
             : status == 413 ? "the request is too large"
                             : "the request is malformed");
    });
    http.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      answer(response, 500, "the request could not be worked on");
    });
  }

  void add_pages() {
    http.Get("/", [](const httplib::Request&, httplib::Response& response) {
      if (const auto page = web::live_page()) {
        response.set_content(page->data(), page->size(), "text/html; charset=utf-8");
      } else {
        answer(response, 404, "this asbuilt was built without the page; GET /state and /events are there");
      }
    });
    http.Get("/state", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(content.state().second, kJson);
    });
    http.Get("/surface", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(content.surface, kJson);
    });
    http.Get("/surface/values", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(content.values(), kJson);
    });
    http.Get("/events", [this](const httplib::Request&, httplib::Response& response) { listen(response); });
  }

  /// Sends the present state, then each new one; states that come faster than they can be sent are skipped.
  void listen(httplib::Response& response) {
    if (++listeners > kMostListeners) {
      --listeners;
      return answer(response, 503, "too many listeners; close some pages");
    }
    auto sent = std::make_shared<std::uint64_t>(0);
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, sent](std::size_t, httplib::DataSink& sink) {
          if (content.revision() == *sent) {
            std::unique_lock lock(mutex);
            const std::uint64_t before = ticks;
            if (!stopping && content.revision() == *sent) {
              changed.wait_for(lock, std::chrono::seconds(10), [&] { return stopping || ticks != before; });
            }
            if (stopping) {
              sink.done();
              return false;
            }
          }
          std::string text = ": still here\n\n";
          if (content.revision() != *sent) {
            const auto [revision, state] = content.state();
            text = fmt::format("event: state\nid: {}\ndata: {}\n\n", revision, state);
            *sent = revision;
          }
          return sink.write(text.data(), text.size());
        },
        [this](bool) { --listeners; });
  }

  void add_actions() {
    http.Post("/scans", [this](const httplib::Request& request, httplib::Response& response,
                               const httplib::ContentReader& body) { take_upload(request, response, body); });
    http.Post(R"(/scans/([^/]+)/restore)", [this](const httplib::Request& request, httplib::Response& response) {
      act_on_file(request.matches[1], response, requests.restore);
    });
    http.Delete(R"(/scans/([^/]+))", [this](const httplib::Request& request, httplib::Response& response) {
      act_on_file(request.matches[1], response, requests.take_out);
    });
    http.Post("/result", [this](const httplib::Request&, httplib::Response& response) {
      requests.write_result();
      response.status = 202;
      response.set_content(R"({"started":true})", kJson);
    });
  }

  static void act_on_file(const std::string& file, httplib::Response& response,
                          const std::function<bool(const std::string&)>& action) {
    if (const auto objection = objection_to_name(file)) return answer(response, 400, *objection);
    if (!action(file)) return answer(response, 404, "the session has no such file");
    response.status = 202;
    response.set_content(nlohmann::json{{"file", file}}.dump(), kJson);
  }

  void take_upload(const httplib::Request& request, httplib::Response& response, const httplib::ContentReader& body) {
    const auto refuse = [&](int status, const std::string& reason) { answer(response, status, reason); };
    if (request.get_param_value_count("name") != 1) return refuse(400, "give the file's name as ?name=...");
    const std::string file = request.get_param_value("name");
    if (const auto objection = objection_to_name(file)) return refuse(400, *objection);
    if (request.is_multipart_form_data()) return refuse(400, "send the file itself as the body, not a form");
    if (!request.has_header("Content-Length") && request.get_header_value("Transfer-Encoding") != "chunked") {
      return refuse(400, "the request has no length");
    }
    // The library would read all of it first, only to throw it away.
    const std::uint64_t announced = std::strtoull(request.get_header_value("Content-Length").c_str(), nullptr, 10);
    if (announced > options.largest_upload) return refuse(413, "the file is too large");
    Upload upload(watched, file);
    const bool whole = body([&](const char* data, std::size_t size) {
      return upload.bytes() + size <= options.largest_upload && upload.append(data, size);
    });
    const auto could_not_be_stored = [&] {
      const bool is_full = upload.failure() == std::errc::no_space_on_device;
      refuse(is_full ? 507 : 500, fmt::format("{} could not be stored: {}", file, upload.failure().message()));
    };
    if (upload.failure()) return could_not_be_stored();
    if (!whole) {
      const bool too_large = response.status == 413 || upload.bytes() >= options.largest_upload;
      return refuse(too_large ? 413 : 400, too_large ? "the file is too large" : "the file did not come whole");
    }
    if (upload.bytes() == 0) return refuse(400, "the file is empty");
    if (!upload.finish()) return could_not_be_stored();
    response.status = 202;
    response.set_content(nlohmann::json{{"file", file}, {"bytes", upload.bytes()}}.dump(), kJson);
  }
};

Server::Server(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}

Result<std::unique_ptr<Server>> Server::start(Content content, const fs::path& watched, const ServerOptions& options,
                                              Requests requests) {
  auto own = std::make_unique<Implementation>(std::move(content), watched, options, std::move(requests));
  own->rules.on_loopback = is_loopback(options.host);
  own->rules.token = options.token;
  if (!own->rules.on_loopback && own->rules.token.empty()) own->rules.token = random_token();
  own->guard();
  own->add_pages();
  own->add_actions();
  own->http.new_task_queue = [] { return new httplib::ThreadPool(kMostListeners + 8); };
  own->http.set_payload_max_length(options.largest_upload);
  // One request a connection: what is left of a body that nobody read, as that of a refused request, must not be
  // taken for a request of its own, which could then say of itself that it comes from here.
  own->http.set_keep_alive_max_count(1);
  own->http.set_read_timeout(30);
  own->http.set_tcp_nodelay(true);
  // Not the library's SO_REUSEPORT, with which two servers share a port without a word.
  own->http.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  errno = 0;
  const int port = options.port == 0 ? own->http.bind_to_any_port(options.host.c_str())
                   : own->http.bind_to_port(options.host.c_str(), options.port) ? options.port
                                                                                : -1;
  if (port < 0) {
    return fail(
        ErrorCode::unwritable_output,
        options.port == 0
            ? fmt::format("{}: is no address of this machine; choose another --host", options.host)
            : fmt::format("port {} of {} cannot be had ({}); another program, perhaps another asbuilt live, may "
                          "be using it: choose another --port, or 0 for any",
                          options.port, options.host, errno != 0 ? std::strerror(errno) : "taken"));
  }
  own->rules.port = port;
  Implementation& running = *own;
  own->thread = std::thread([&running] { running.http.listen_after_bind(); });
  return std::unique_ptr<Server>(new Server(std::move(own)));
}

Server::~Server() {
  {
    const std::lock_guard lock(implementation_->mutex);
    implementation_->stopping = true;
  }
  implementation_->changed.notify_all();
  while (!implementation_->http.is_running() && implementation_->thread.joinable()) {
    std::this_thread::yield();  // stop() before the loop has begun would be lost
  }
  implementation_->http.stop();
  implementation_->thread.join();
}

int Server::port() const { return implementation_->rules.port; }
std::string Server::token() const { return implementation_->rules.token; }

std::string Server::address() const {
  const std::string host = implementation_->rules.on_loopback ? "localhost" : implementation_->options.host;
  const std::string token = implementation_->rules.token;
  return fmt::format("http://{}:{}/{}", host, port(), token.empty() ? "" : "?token=" + token);
}

void Server::state_changed() {
  {
    const std::lock_guard lock(implementation_->mutex);
    ++implementation_->ticks;
  }
  implementation_->changed.notify_all();
}

}  // namespace asbuilt::viewer

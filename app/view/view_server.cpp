// SPDX-License-Identifier: Apache-2.0
#include "app/view/view_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/un.h>

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "app/program/stop_signal.h"

// The only source that includes Beast and Asio, whose headers take longer to compile than all else in this
// room.

namespace tendril::app {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using nlohmann::json;
using Local = asio::local::stream_protocol;
using Tcp = asio::ip::tcp;

namespace {

constexpr std::size_t kMaxLine = 65'536;                   // bytes of a page's message, as the daemon has it
constexpr std::size_t kMaxAnswer = 64 * 1024 * 1024;       // bytes of a daemon's line
constexpr int kMaxVisits = 64;                             // connections at once, pages included
constexpr auto kVisitPatience = std::chrono::seconds(15);  // for a request, and between two
constexpr auto kRetry = std::chrono::milliseconds(500);    // looks again for a daemon
constexpr auto kLookForStop = std::chrono::milliseconds(50);

/// What all visits share.
struct Shared {
  ViewConfig config;
  int visits = 0, pages = 0;
};

/// Counts as long as it lives.
class Counted {
 public:
  explicit Counted(int& count) : count_(&count) { ++count; }
  Counted(Counted&& other) noexcept : count_(std::exchange(other.count_, nullptr)) {}
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  Counted& operator=(Counted&&) = delete;
  ~Counted() {
    if (count_) --*count_;
  }

 private:
  int* count_;
};

/// A message that a page has sent; discarded where it is none, or nested more deeply than the daemon takes
/// it.
json read_message(const std::string& text) {
  int depth = 0;
  for (const char letter : text) {
    if (letter == '[' || letter == '{') ++depth;
    if (letter == ']' || letter == '}') --depth;
    if (depth > 32) return json(json::value_t::discarded);
  }
  return json::parse(text, nullptr, false);
}

std::string refusal(const json& request, const char* code, const std::string& message) {
  return json{{"id", request.is_object() ? request.value("id", json()) : json()},
              {"ok", false},
              {"error", {{"code", code}, {"message", message}}}}
      .dump();
}

/// A page that is looked at: its WebSocket, and its connection to the daemon.
class Page : public std::enable_shared_from_this<Page> {
 public:
  using Request = http::request<http::empty_body>;

  Page(beast::tcp_stream stream, Shared& shared, Counted visit)
      : shared_(shared),
        visit_(std::move(visit)),
        page_(shared.pages),
        socket_(std::move(stream)),
        daemon_(socket_.get_executor()),
        retry_(socket_.get_executor()) {}

  void start(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();  // the WebSocket has time-outs of its own
    auto patience = websocket::stream_base::timeout::suggested(beast::role_type::server);
    patience.keep_alive_pings = true;
    socket_.set_option(patience);
    socket_.read_message_max(kMaxLine);
    socket_.text(true);
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->open_ = true;
      self->listen();
      self->connect();
    });
  }

 private:
  void end() {
    open_ = false;
    ++connection_;
    error_code untold;
    daemon_.close(untold);
    retry_.cancel();
    beast::get_lowest_layer(socket_).close();
  }

  // To the page.

  void send(std::string message) {
    to_page_.push_back(std::move(message));
    if (to_page_.size() == 1) write();
  }

  void write() {
    socket_.async_write(asio::buffer(to_page_.front()),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          if (!self->open_) return;
                          if (error) return self->end();
                          self->to_page_.pop_front();
                          if (!self->to_page_.empty()) return self->write();
                          self->read_daemon();
                        });
  }

  /// The next line of the daemon, once the page has taken all before it.
  void read_daemon() {
    if (!connected_ || reading_ || !to_page_.empty()) return;
    reading_ = true;
    asio::async_read_until(
        daemon_, asio::dynamic_buffer(from_daemon_, kMaxAnswer), '\n',
        [self = shared_from_this(), connection = connection_](error_code error, std::size_t size) {
          if (connection != self->connection_) return;
          self->reading_ = false;
          if (error) return self->lose("the daemon has ended");
          std::string line = self->from_daemon_.substr(0, size - 1);
          self->from_daemon_.erase(0, size);
          self->told_.clear();
          self->send(std::move(line));
        });
  }

  void connect() {
    const std::string path = shared_.config.socket.string();
    daemon_ = Local::socket(socket_.get_executor());
    daemon_.async_connect(Local::endpoint(path),
                          [self = shared_from_this(), path, connection = connection_](error_code error) {
                            if (connection != self->connection_) return;
                            if (error)
                              return self->lose(fmt::format("no daemon at {}: {}", path, error.message()));
                            self->connected_ = true;
                            self->read_daemon();
                          });
  }

  void lose(const std::string& why) {
    ++connection_;
    connected_ = reading_ = false;
    from_daemon_.clear();
    error_code untold;
    daemon_.close(untold);
    if (std::exchange(told_, why) != why) send(json{{"view", {{"daemon", false}, {"message", why}}}}.dump());
    retry_.expires_after(kRetry);
    retry_.async_wait([self = shared_from_this()](error_code error) {
      if (!error && self->open_) self->connect();
    });
  }

  // From the page.

  void listen() {
    socket_.async_read(from_page_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!self->open_) return;
      if (error) return self->end();
      const std::string text = beast::buffers_to_string(self->from_page_.data());
      self->from_page_.clear();
      self->hear(text);
    });
  }

  /// Listens again once it is done.
  void hear(const std::string& text) {
    const json message = read_message(text);
    if (!message.is_object()) {
      send(refusal(message, "bad_json", "a message is one JSON object, at most 32 levels deep"));
      return listen();
    }
    if (message.contains("token")) {
      check_token(message["token"]);
      return listen();
    }
    const json command = message.value("command", json());
    if (!control_ && !(command.is_string() && only_watches(command.get<std::string>()))) {
      send(refusal(message, "no_token",
                   "this page only watches: open the address with the token that tendril-view printed"));
      return listen();
    }
    if (!connected_) {
      send(refusal(message, "no_daemon", "there is no daemon"));
      return listen();
    }
    to_daemon_ = message.dump() + '\n';  // as it was understood here
    asio::async_write(daemon_, asio::buffer(to_daemon_),
                      [self = shared_from_this()](error_code, std::size_t) {
                        if (self->open_) self->listen();  // where the daemon has gone, reading tells it
                      });
  }

  void check_token(const json& token) {
    control_ = token.is_string() && same_token(token.get<std::string>(), shared_.config.token);
    json view{{"control", control_}};
    if (!control_) {
      view["message"] = "this is not the token of tendril-view, so the page only watches";
      spdlog::warn("a page came with a wrong token");
    }
    send(json{{"view", view}}.dump());
  }

  Shared& shared_;
  Counted visit_, page_;
  websocket::stream<beast::tcp_stream> socket_;
  Local::socket daemon_;
  asio::steady_timer retry_;
  bool open_ = false, control_ = false;
  bool connected_ = false, reading_ = false;  // from the daemon
  int connection_ = 0;  // to the daemon, counted: what was begun on an earlier one is over
  std::string from_daemon_, to_daemon_, told_;
  std::deque<std::string> to_page_;
  beast::flat_buffer from_page_;
};

/// A connection of a browser, until it becomes a page.
class Visit : public std::enable_shared_from_this<Visit> {
 public:
  Visit(Tcp::socket socket, Shared& shared)
      : shared_(shared), visit_(shared.visits), stream_(std::move(socket)) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(8192);
    stream_.expires_after(kVisitPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error == http::error::end_of_stream || error == beast::error::timeout) return;
      if (error.category() == make_error_code(http::error::bad_method).category())
        return self->refuse(http::status::bad_request, "this is no request that a browser sends\n", false);
      if (!error) self->answer();
    });
  }

 private:
  void answer() {
    const auto& request = parser_->get();
    const std::string host(request[http::field::host]);
    if (!is_own_host(host))
      return refuse(http::status::misdirected_request,
                    "use the address of this machine in numbers, or localhost: a name is not safe\n", false);
    const std::string target(request.target().substr(0, request.target().find('?')));
    if (target == "/live") return become_page(host);
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(http::status::method_not_allowed, "only GET and HEAD\n", false);
    const auto file = shared_.config.files.find(target);
    if (file == shared_.config.files.end())
      return refuse(http::status::not_found, "there is no such page\n", request.keep_alive());
    respond(http::status::ok, file->second.type, file->second.content, request.keep_alive(), host);
  }

  void become_page(const std::string& host) {
    const auto& request = parser_->get();
    if (!websocket::is_upgrade(request))
      return refuse(http::status::upgrade_required, "this is a WebSocket\n", false);
    if (!is_own_origin(std::string(request[http::field::origin]), host)) {
      spdlog::warn("a page of {} was refused", std::string(request[http::field::origin]));
      return refuse(http::status::forbidden, "a page of another origin may not watch this robot\n", false);
    }
    if (shared_.pages >= ViewServer::kMaxPages)
      return refuse(http::status::service_unavailable,
                    fmt::format("{} pages watch already; close one\n", shared_.pages), false);
    std::make_shared<Page>(std::move(stream_), shared_, std::move(visit_))->start(request);
  }

  void refuse(http::status status, const std::string& why, bool keep_alive) {
    respond(status, "text/plain; charset=utf-8", why, keep_alive, "");
  }

  void respond(http::status status, const char* type, const std::string& content, bool keep_alive,
               const std::string& host) {
    const bool head = parser_->get().method() == http::verb::head;
    auto& response = response_.emplace(status, 11);
    response.set(http::field::content_type, type);
    response.set(http::field::cache_control, "no-cache");
    response.set(
        "Content-Security-Policy",
        fmt::format("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
                    "connect-src 'self'{}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                    // For browsers to which 'self' is not also the WebSocket.
                    host.empty() ? "" : fmt::format(" ws://{0} wss://{0}", host)));
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    if (status == http::status::method_not_allowed) response.set(http::field::allow, "GET, HEAD");
    response.keep_alive(keep_alive);
    response.body() = content;
    response.prepare_payload();
    if (head) response.body().clear();
    stream_.expires_after(kVisitPatience);
    http::async_write(stream_, response,
                      [self = shared_from_this(), keep_alive](error_code error, std::size_t) {
                        if (error) return;
                        if (keep_alive) return self->read();
                        error_code untold;
                        self->stream_.socket().shutdown(Tcp::socket::shutdown_send, untold);
                      });
  }

  Shared& shared_;
  Counted visit_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::string_body>> response_;
};

}  // namespace

struct ViewServer::Parts {
  explicit Parts(ViewConfig config)
      : shared{std::move(config)}, acceptor(context), pause(context), stop(context) {}

  void listen() {
    const Address& where = shared.config.listen;
    if (const std::string path = shared.config.socket.string(); path.size() >= sizeof(sockaddr_un::sun_path))
      throw std::runtime_error(fmt::format("{}: the path of a socket is shorter", path));
    try {
      const Tcp::endpoint endpoint(asio::ip::make_address(where.host), where.port);
      acceptor.open(endpoint.protocol());
      acceptor.set_option(Tcp::acceptor::reuse_address(true));
      acceptor.bind(endpoint);
      acceptor.listen();
    } catch (const boost::system::system_error& error) {
      throw std::runtime_error(fmt::format("cannot listen at {}: {}; {}", where.text(),
                                           error.code().message(),
                                           error.code() == asio::error::address_in_use
                                               ? "another program has the port, choose one with --listen"
                                               : "choose an address of this machine with --listen"));
    }
    accept();
  }

  void accept() {
    acceptor.async_accept([this](error_code error, Tcp::socket socket) {
      if (!error && shared.visits < kMaxVisits) std::make_shared<Visit>(std::move(socket), shared)->read();
      if (!error) return accept();
      pause.expires_after(kRetry);  // too many open files, for one
      pause.async_wait([this](error_code cancelled) {
        if (!cancelled) accept();
      });
    });
  }

  void look_for_stop() {
    if (stop_signalled()) return context.stop();
    stop.expires_after(kLookForStop);
    stop.async_wait([this](error_code) { look_for_stop(); });
  }

  Shared shared;  // outlives the visits, which the context owns
  asio::io_context context{1};
  Tcp::acceptor acceptor;
  asio::steady_timer pause, stop;
};

ViewServer::ViewServer(ViewConfig config) : parts_(std::make_unique<Parts>(std::move(config))) {
  parts_->listen();
}

ViewServer::~ViewServer() = default;

Address ViewServer::address() const {
  return {parts_->shared.config.listen.host, parts_->acceptor.local_endpoint().port()};
}

void ViewServer::run() {
  parts_->look_for_stop();
  parts_->context.run();
}

}  // namespace tendril::app

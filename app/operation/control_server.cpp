// SPDX-License-Identifier: Apache-2.0
#include "app/operation/control_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/config/utf8.h"
#include "app/robot/robot.h"
#include "rt/periodic_clock.h"

namespace tendril::app {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kDefaultSpeed = 0.05;  // m/s towards a target, where neither the request nor a path says one

ordered_json error_of(const json& id, const RequestError& error) {
  return {{"id", id}, {"ok", false}, {"error", {{"code", error.code()}, {"message", error.what()}}}};
}

std::string text_of(const ordered_json& message) { return to_text(message); }

std::string done(const ControlRequest& request, const ordered_json& told = ordered_json::object()) {
  ordered_json reply = {{"id", request.id}, {"ok", true}};
  reply.update(told);
  return text_of(reply);
}

}  // namespace

ControlServer::ControlServer(const std::filesystem::path& path, const Config& config, TargetSource& targets,
                             rt::Requests& requests, const hal::DriveMaster& master)
    : config_(config), targets_(targets), requests_(requests), robot_(config, master), server_(path, *this) {
  spdlog::info("operators connect to {}", path.string());
}

ControlServer::~ControlServer() {
  if (const std::string line = log_.take(); !line.empty()) spdlog::info("{}", line);
}

void ControlServer::show_body(std::string geometry, rt::SurfaceChannel& channel) {
  body_.emplace(server_, std::move(geometry), channel);
}

void ControlServer::serve() {
  server_.serve();
  if (const std::string line = log_.due(rt::now_ns()); !line.empty()) spdlog::info("{}", line);
  if (body_) body_->serve();
}

void ControlServer::connected(int client) {
  clients_[client] = {};
  server_.send(client, text_of({{"tendril", TENDRIL_VERSION},
                                {"version", kControlProtocol},
                                {"robot", config_.robot},
                                {"rate", config_.control.rate_hz},
                                {"coordinates", robot_.coordinates()}}));
}

void ControlServer::received(int client, std::string_view line) {
  json id;
  try {
    const ControlRequest request = read_request(line, config_, robot_.coordinates());
    id = request.id;
    server_.send(client, answer(client, request));
  } catch (const RequestError& error) {
    server_.send(client, text_of(error_of(id.is_null() ? error.id : id, error)));
  }
}

void ControlServer::too_long(int client) {
  server_.send(client, text_of(error_of(nullptr, {"too_long", fmt::format("a line has at most {} bytes",
                                                                          LineServer::kMaxLine)})));
}

void ControlServer::gone(int client) {
  clients_.erase(client);
  if (body_) body_->gone(client);
  if (client != holder_) return;
  holder_ = 0;
  log_.say(fmt::format("control released: {} is gone", holder_peer_));
}

std::string ControlServer::answer(int client, const ControlRequest& request) {
  require(demands_of(request.command), client);
  const int64_t now_ns = rt::now_ns();
  const auto mode = [&] { return done(request, {{"mode", name(targets_.mode())}}); };
  switch (request.command) {
    case Command::kStatus:
      return done(request, {{"state", state()}});
    case Command::kSubscribe: {
      Subscription& subscription = clients_.at(client);
      subscription.interval_ns = request.rate_hz > 0 ? std::llround(1e9 / request.rate_hz) : 0;
      subscription.due_ns = now_ns;
      return done(request);
    }
    case Command::kGeometry:  // put together as text, since it may be long
      return fmt::format(R"({{"id":{},"ok":true,"geometry":{}}})", text_of(request.id), body().geometry());
    case Command::kSurface:
      body().subscribe(client, request.rate_hz);
      return done(request);
    case Command::kAcquire:
      acquire(client, request.steal);
      return done(request);
    case Command::kRelease:
      release(client);
      return done(request);
    case Command::kTarget:
      aim(request, now_ns);
      return mode();
    case Command::kPlay:
      targets_.follow_path(now_ns);
      return mode();
    case Command::kPause:
      targets_.pause(now_ns);
      return mode();
    case Command::kResume:
      targets_.resume(now_ns);
      return mode();
    case Command::kHold:
      targets_.hold(now_ns);
      return mode();
    case Command::kSet:
      targets_.set_path_rate(now_ns, *request.path_rate);
      return mode();
    case Command::kDisable:
      if (!requests_.standby.exchange(true))
        spdlog::info("drives to be disabled, asked for by {}", server_.peer(client));
      return done(request);
    case Command::kEnable:
      enable();
      return done(request);
    case Command::kReset:
      reset();
      return done(request);
    case Command::kStop:
      if (!requests_.stop.exchange(true)) spdlog::info("stop asked for by {}", server_.peer(client));
      return done(request);
  }
  throw RequestError("unknown_command", "the command has no answer");  // each has returned
}

void ControlServer::require(Demands demands, int client) const {
  if (demands.control && client != holder_)
    throw RequestError("no_control", holder_ == 0 ? "acquire the control first"
                                                  : holder_peer_ + " has the control; acquire it first");
  if (demands.running && (!targets_.begun() || last_.phase > rt::Phase::kRunning))
    throw RequestError("not_running",
                       fmt::format("the robot takes no targets in phase '{}'", rt::name(last_.phase)));
}

BodyWatch& ControlServer::body() {
  if (!body_) throw RequestError("not_running", "the body is not shown");
  return *body_;
}

void ControlServer::acquire(int client, bool steal) {
  if (holder_ == client) return;
  if (holder_ != 0 && !steal)
    throw RequestError("control_taken", holder_peer_ + " has the control; \"steal\": true takes it away");
  const std::string peer = server_.peer(client);
  log_.say(holder_ == 0 ? fmt::format("control acquired by {}", peer)
                        : fmt::format("control acquired by {}, taken away from {}", peer, holder_peer_));
  if (holder_ != 0) server_.send(holder_, text_of({{"event", "control_lost"}, {"to", peer}}));
  holder_ = client;
  holder_peer_ = peer;
}

void ControlServer::release(int client) {
  if (client != holder_) throw RequestError("no_control", "this client does not have the control");
  holder_ = 0;
  log_.say(fmt::format("control released by {}", holder_peer_));
}

void ControlServer::enable() {
  if (last_.latched.present) throw RequestError("faulted", "a fault has stopped the robot: reset it");
  spdlog::info("drives to be enabled, asked for by {}", holder_peer_);
  requests_.standby = false;
}

void ControlServer::reset() {
  if (!last_.latched.present) throw RequestError("no_fault", "there is no fault to reset");
  if (last_.phase != rt::Phase::kStandby)
    throw RequestError("not_standby",
                       fmt::format("the robot is in phase '{}'; a fault is reset in phase 'standby'",
                                   rt::name(last_.phase)));
  spdlog::info("fault reset by {}", holder_peer_);
  requests_.reset();
}

void ControlServer::aim(const ControlRequest& request, int64_t now_ns) {
  const rt::EffectorVector from = targets_.wanted(now_ns);
  rt::EffectorVector goal = from;
  const auto rows = effector_rows(config_);
  double way = 0;  // m, of the positions
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto k = static_cast<Eigen::Index>(r);
    if (request.position[r]) goal[k] = *request.position[r];
    if (rows[r].is_position()) way = std::hypot(way, goal[k] - from[k]);
  }
  const double speed = request.speed.value_or(config_.motion ? config_.motion->speed : kDefaultSpeed);
  if (!request.in_s && motion_limits(config_)) return targets_.go(now_ns, goal, speed);
  const double duration_s = request.in_s.value_or(way / speed);
  targets_.aim(now_ns, goal, std::llround(1e9 * duration_s), request.velocity);
}

ordered_json ControlServer::state() const {
  ordered_json state = robot_.describe(last_);
  state["mode"] = name(targets_.mode());
  state["path_rate"] = targets_.path_rate();
  state["control"] = holder_ == 0 ? ordered_json() : ordered_json(holder_peer_);
  return state;
}

void ControlServer::add(const rt::TraceRecord& record) {
  last_ = record;
  std::string line;
  for (auto& [client, subscription] : clients_) {
    if (subscription.interval_ns == 0 || record.intended_ns < subscription.due_ns) continue;
    subscription.due_ns = std::max(subscription.due_ns + subscription.interval_ns,
                                   record.intended_ns);  // the next cycle, where the rate is above the loop's
    if (line.empty()) line = text_of({{"state", state()}});
    if (subscription.dropped > 0 &&
        server_.send(client, text_of({{"event", "states_dropped"}, {"count", subscription.dropped}})))
      subscription.dropped = 0;
    if (!server_.send(client, line)) ++subscription.dropped;
  }
}

}  // namespace tendril::app

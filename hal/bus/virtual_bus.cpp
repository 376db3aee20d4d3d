// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/virtual_bus.h"

#include <algorithm>
#include <utility>

namespace tendril::hal {

VirtualEndpoint::VirtualEndpoint(VirtualBus& medium, std::string name, int capacity)
    : medium_(medium), name_(std::move(name)), queue_(static_cast<size_t>(capacity)) {
  limit_waiting(capacity);
}

void VirtualEndpoint::limit_waiting(int frames) {
  waiting_limit_ = static_cast<size_t>(frames);
  waiting_.reserve(waiting_limit_);
}

void VirtualEndpoint::set_stalled(bool stalled) noexcept {
  stalled_ = stalled;
  if (stalled) return;
  if (connected())
    for (const Frame& frame : waiting_) medium_.broadcast(*this, frame);
  waiting_.clear();
}

bool VirtualEndpoint::connected() const noexcept {
  return plugged_ && !stalled_ && health_ != BusHealth::kOff && health_ != BusHealth::kDown;
}

SendResult VirtualEndpoint::send(std::span<const Frame> frames) noexcept {
  if (health_ == BusHealth::kOff || health_ == BusHealth::kDown) return SendResult::kDown;
  const size_t taken = stalled_ ? std::min(frames.size(), waiting_limit_ - waiting_.size()) : frames.size();
  refused_ = taken < frames.size();
  if (stalled_) {
    waiting_.insert(waiting_.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(taken));
    dropped_ += frames.size() - taken;
    return refused_ ? SendResult::kQueueFull : SendResult::kSent;
  }
  if (plugged_)
    for (const Frame& frame : frames) medium_.broadcast(*this, frame);
  return SendResult::kSent;
}

int VirtualEndpoint::receive(std::span<Frame> frames) noexcept {
  int taken = 0;
  for (Frame& frame : frames) {
    if (size_ == 0 || queue_[head_].stamp_ns > medium_.now_ns_) break;
    frame = queue_[head_];
    head_ = (head_ + 1) % queue_.size();
    --size_;
    ++taken;
  }
  return taken;
}

std::string VirtualEndpoint::describe() const { return "virtual bus, node " + name_; }

void VirtualEndpoint::push(const Frame& frame) noexcept {
  if (size_ == queue_.size()) {
    ++dropped_;
    return;
  }
  queue_[(head_ + size_) % queue_.size()] = frame;
  ++size_;
}

VirtualBus::VirtualBus(int64_t delay_ns, int capacity) : delay_ns_(delay_ns), capacity_(capacity) {}

VirtualEndpoint& VirtualBus::attach(std::string name) {
  endpoints_.emplace_back(new VirtualEndpoint(*this, std::move(name), capacity_));
  return *endpoints_.back();
}

void VirtualBus::broadcast(const VirtualEndpoint& from, const Frame& frame) noexcept {
  Frame arriving = frame;
  arriving.stamp_ns = now_ns_ + delay_ns_;
  for (const auto& endpoint : endpoints_)
    if (endpoint.get() != &from && endpoint->connected()) endpoint->push(arriving);
}

}  // namespace tendril::hal

// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/service_manager.h"

#include <systemd/sd-daemon.h>

#include "app/config/utf8.h"

namespace tendril::app {

ServiceManager::ServiceManager() {
  uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) interval_ns_ = static_cast<int64_t>(watchdog_us) * 1000 / 2;
}

void ServiceManager::ready() { sd_notify(0, "READY=1"); }

void ServiceManager::stopping() { sd_notify(0, "STOPPING=1"); }

void ServiceManager::status(const std::string& line) { sd_notify(0, ("STATUS=" + valid_utf8(line)).c_str()); }

void ServiceManager::feed_watchdog(int64_t now_ns, int64_t cycles) {
  if (interval_ns_ == 0 || now_ns < due_ns_ || cycles == cycles_fed_) return;
  sd_notify(0, "WATCHDOG=1");
  due_ns_ = now_ns + interval_ns_;
  cycles_fed_ = cycles;
}

}  // namespace tendril::app

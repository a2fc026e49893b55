// SPDX-License-Identifier: MIT
#include "monitor/brokers/broker_source.hpp"

namespace resonid::monitor {

void BrokerSource::run() {
  constexpr double kFirstAttempt_s = 0.25;
  Backoff backoff(kFirstAttempt_s);
  while (!stopping()) {
    set_state(SourceState::starting);
    std::string why = serve();
    if (stopping()) return;
    if (status().state == SourceState::running) backoff.reset();
    set_state(SourceState::waiting, std::move(why));
    static_cast<void>(wait(backoff.next_s()));
  }
}

}  // namespace resonid::monitor

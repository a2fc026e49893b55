// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "monitor/brokers/feed.hpp"
#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {

/// A source that feeds from a broker, on one thread that keeps the connection.
class BrokerSource : public ThreadSource {
 protected:
  BrokerSource(Axes& axes, std::vector<TopicSettings> topics, TopicSyntax syntax)
      : ThreadSource(axes), feed_(delivery_, std::move(topics), syntax) {}

  /// Connects and feeds until the source is to stop or there is no going on: tells why. Called again after a
  /// wait, which doubles while the state never comes to be `running`.
  [[nodiscard]] virtual std::string serve() = 0;

  Feed feed_;

 private:
  void run() final;
};

}  // namespace resonid::monitor

// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "monitor/brokers/feed.hpp"

namespace resonid::monitor {

/// A source that feeds from a broker on one thread, which keeps the connection. Who derives from it calls
/// stop() in the destructor.
class BrokerSource : public Source {
 public:
  void start() final;
  void stop() final;
  [[nodiscard]] SourceStatus status() const final;

 protected:
  BrokerSource(Axes& axes, std::vector<TopicSettings> topics, TopicSyntax syntax)
      : feed_(axes, std::move(topics), syntax) {}

  /// Connects and feeds until the source is to stop or there is no going on: tells why. Called again after a
  /// wait, which doubles while the state never comes to be `running`.
  [[nodiscard]] virtual std::string run() = 0;

  /// As status() tells.
  void set(SourceState state, std::string text = {});
  /// Returns early when the source is to stop.
  void wait(double seconds);
  [[nodiscard]] bool stopping() const noexcept { return feed_.stopping(); }

  Feed feed_;

 private:
  void loop();

  std::thread thread_;
  mutable std::mutex mutex_;
  std::mutex ending_;
  std::condition_variable changed_;
  SourceState state_ = SourceState::starting;
  std::string text_;
};

}  // namespace resonid::monitor

// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <monitor/service/installation.hpp>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace resonid::monitor {

/// Whether a condition comes true within seconds.
template <class Condition>
bool eventually(Condition condition) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// Who is told of alarms, beyond the life of a process.
class FakeReceiver {
 public:
  std::atomic<int> fails{0};       ///< So many messages are not taken.
  std::atomic<bool> hangs{false};  ///< No message is taken until it is interrupted.
  std::atomic<const char*> field{"publisher"};

  [[nodiscard]] InstalledTarget target(const std::string& name) {
    return {name, "alarms", [this]() -> expected<std::unique_ptr<Publisher>, Error> {
              return std::make_unique<FakePublisher>(*this);
            }};
  }
  [[nodiscard]] std::vector<std::string> keys() const {
    const std::scoped_lock lock(mutex_);
    return keys_;
  }
  [[nodiscard]] std::vector<std::string> bodies() const {
    const std::scoped_lock lock(mutex_);
    return bodies_;
  }

 private:
  class FakePublisher : public Publisher {
   public:
    explicit FakePublisher(FakeReceiver& receiver) : receiver_(receiver) {}
    [[nodiscard]] expected<void, Error> publish(std::string_view key, std::string_view,
                                                std::string_view body) override {
      std::unique_lock lock(receiver_.mutex_);
      if (receiver_.hangs) receiver_.changed_.wait(lock, [&] { return interrupted_; });
      if (interrupted_ || receiver_.fails > 0) {
        --receiver_.fails;
        return tl::unexpected(Error{receiver_.field.load(), "no answer"});
      }
      receiver_.keys_.emplace_back(key);
      receiver_.bodies_.emplace_back(body);
      return {};
    }
    void interrupt() override {
      const std::scoped_lock lock(receiver_.mutex_);
      interrupted_ = true;
      receiver_.changed_.notify_all();
    }

   private:
    FakeReceiver& receiver_;
    bool interrupted_ = false;
  };

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> keys_, bodies_;
};

}  // namespace resonid::monitor

// SPDX-License-Identifier: MIT
#pragma once

#include <httplib.h>  // behind Eigen, which its system headers redefine a name of

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace resonid::monitor {

/// A receiver of webhooks on a free port.
class Webhook {
 public:
  Webhook() {
    server_.Post("/hook", [this](const httplib::Request& request, httplib::Response& response) {
      std::unique_lock lock(mutex_);
      if (fails-- > 0) {
        response.status = 503;
        return;
      }
      requests_.push_back(request);
      released_.wait(lock, [&] { return !hangs; });
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::yield();
  }
  Webhook(const Webhook&) = delete;
  Webhook& operator=(const Webhook&) = delete;
  ~Webhook() {
    {
      const std::scoped_lock lock(mutex_);
      hangs = false;
    }
    released_.notify_all();
    server_.stop();
    thread_.join();
  }
  [[nodiscard]] std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/hook"; }
  [[nodiscard]] std::vector<httplib::Request> requests() const {
    const std::scoped_lock lock(mutex_);
    return requests_;
  }

  std::atomic<int> fails{0};
  std::atomic<bool> hangs{false};

 private:
  httplib::Server server_;
  int port_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable released_;
  std::vector<httplib::Request> requests_;
  std::thread thread_;
};

}  // namespace resonid::monitor

// SPDX-License-Identifier: MIT
#pragma once

#include <nats/nats.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "../io/temporary_folder.hpp"
#include "monitor/samples/intake.hpp"
#include "monitor/sources/source.hpp"

struct mosquitto;

namespace resonid::monitor::test {

using resonid::test::TemporaryFolder;

/// Ends the test, aloud, where a program is not installed.
#define RESONID_REQUIRE_PROGRAM(name)       \
  if (!resonid::monitor::test::found(name)) \
  GTEST_SKIP() << name << " is not installed (see tools/packages.txt)"

[[nodiscard]] bool found(const std::string& program);
[[nodiscard]] std::uint16_t free_port();
/// Whether it becomes true in time.
[[nodiscard]] bool until(const std::function<bool()>& condition, double seconds = 10.0);

/// Another process.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments, const std::filesystem::path& log = "/dev/null");
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() { end(9); }

  /// Sends the signal (0: none) and waits for the end.
  void end(int signal);
  /// Sends it and goes on.
  void send(int signal) const;

 private:
  pid_t process_ = -1;
};

/// A mosquitto of our own, which keeps its queues when it is stopped.
class Mosquitto {
 public:
  /// @param more lines of its configuration
  explicit Mosquitto(const std::string& more = "allow_anonymous true");
  void start();
  /// As a service is stopped.
  void stop() { program_->end(15); }

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  [[nodiscard]] const TemporaryFolder& folder() const noexcept { return folder_; }

 private:
  TemporaryFolder folder_;
  std::uint16_t port_ = free_port();
  std::unique_ptr<Program> program_;
};

/// A nats-server of our own with JetStream.
class NatsServer {
 public:
  explicit NatsServer(const std::string& more = "");
  void start();
  void stop() { program_->end(15); }
  /// Answers nobody until `go_on`.
  void pause() { program_->send(SIGSTOP); }
  void go_on() { program_->send(SIGCONT); }

  [[nodiscard]] std::string url() const { return "nats://127.0.0.1:" + std::to_string(port_); }
  [[nodiscard]] const TemporaryFolder& folder() const noexcept { return folder_; }

 private:
  TemporaryFolder folder_;
  std::uint16_t port_ = free_port();
  std::unique_ptr<Program> program_;
};

inline constexpr std::int64_t kStart_ns = 1'790'000'000'000'000'000;  ///< Of sample 0.
inline constexpr double kRate_hz = 2000.0;
inline constexpr std::size_t kFrame = 20;  ///< Samples of one.

/// What sample k of an axis is: three values that tell k, which float32 holds exactly.
[[nodiscard]] double value_of(std::uint64_t sample, std::size_t column);
/// A frame of `samples` from `first` on with columns ru, u, y.
[[nodiscard]] std::string frame_of(std::string_view axis, std::uint64_t first, std::size_t samples = kFrame,
                                   double rate_hz = kRate_hz);

/// Makes NAME.pem and NAME.key for localhost, signed by itself.
void make_certificate(const TemporaryFolder& folder, const std::string& name);
/// Further lines of a NatsServer that shows the certificate "right"; "wrong" is there, too.
[[nodiscard]] std::string with_tls(const TemporaryFolder& folder);

/// Axes with rings in a folder.
class Rings : public Axes {
 public:
  Rings(const std::filesystem::path& folder, const std::vector<std::string>& names,
        std::uint64_t capacity = 1'000'000);
  [[nodiscard]] Intake* find(std::string_view name) override;
  [[nodiscard]] std::span<Intake* const> all() override { return all_; }
  [[nodiscard]] Ring& ring(std::string_view name) { return *axes_.find(name)->second.ring; }
  [[nodiscard]] Intake& intake(std::string_view name) { return *axes_.find(name)->second.intake; }

 private:
  struct Axis {
    std::unique_ptr<Ring> ring;
    std::unique_ptr<Intake> intake;
  };
  std::map<std::string, Axis, std::less<>> axes_;
  std::vector<Intake*> all_;
};

/// The ring has samples 0 ... count - 1, each once, each with its own values.
void expect_stored(Ring& ring, std::uint64_t count);

/// Publishes with QoS 1, by the library itself.
class MqttSender {
 public:
  /// @param authorities of TLS; empty: without TLS
  explicit MqttSender(std::uint16_t port, const std::string& authorities = {});
  MqttSender(const MqttSender&) = delete;
  MqttSender& operator=(const MqttSender&) = delete;
  ~MqttSender();
  void send(const std::string& topic, std::string_view payload);
  /// Waits until the broker has all.
  void finish();

 private:
  mosquitto* client_;
  std::atomic<int> acknowledged_{0};
  int sent_ = 0;
};

/// Publishes to subjects and streams, by the library itself.
class NatsSender {
 public:
  /// By TLS where `authorities`, a file, are given.
  explicit NatsSender(const std::string& url, const std::string& authorities = {});
  NatsSender(const NatsSender&) = delete;
  NatsSender& operator=(const NatsSender&) = delete;
  ~NatsSender();
  void make_stream(const char* name, const char* subjects);
  void delete_stream(const char* name);
  /// What the stream has not acknowledged is published again.
  void store(const std::string& subject, std::string_view payload);
  void send(const std::string& subject, std::string_view payload);
  void flush();
  [[nodiscard]] natsConnection* connection() noexcept { return connection_; }

 private:
  natsConnection* connection_ = nullptr;
  jsCtx* js_ = nullptr;
};

/// What the sources of the kill tests are.
[[nodiscard]] std::unique_ptr<Source> mqtt_source(std::uint16_t port, Axes& axes, int version = 4);
[[nodiscard]] std::unique_ptr<Source> jetstream_source(const std::string& url, Axes& axes,
                                                       const std::string& filter = "machines.*.samples");

}  // namespace resonid::monitor::test

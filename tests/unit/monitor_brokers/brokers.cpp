// SPDX-License-Identifier: MIT
#include "brokers.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <mosquitto.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "monitor/brokers/mqtt_source.hpp"
#include "monitor/brokers/nats_source.hpp"
#include "monitor/samples/frame.hpp"

namespace resonid::monitor::test {
namespace {

const ColumnNames kColumns = {"ru", "u", "y", ""};

sockaddr_in local(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

bool listens(std::uint16_t port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = local(port);
  const bool connected = ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(socket);
  return connected;
}

void require(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error(what);
}

void require(natsStatus status) { require(status == NATS_OK, natsStatus_GetText(status)); }

void look_in_sbin() {
  const char* path = std::getenv("PATH");
  ::setenv("PATH", (std::string(path == nullptr ? "" : path) + ":/usr/sbin").c_str(), 1);
}

}  // namespace

bool found(const std::string& program) {
  const char* path = std::getenv("PATH");
  for (std::string rest = std::string(path == nullptr ? "" : path) + ":/usr/sbin:/usr/local/sbin:";
       !rest.empty();) {
    const std::size_t end = rest.find(':');
    if (::access((rest.substr(0, end) + "/" + program).c_str(), X_OK) == 0) return true;
    rest.erase(0, end + 1);
  }
  return false;
}

std::uint16_t free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = local(0);
  socklen_t size = sizeof address;
  const bool bound = ::bind(socket, reinterpret_cast<const sockaddr*>(&address), size) == 0 &&
                     ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  ::close(socket);
  require(bound, "no free port");
  return ntohs(address.sin_port);
}

bool until(const std::function<bool()>& condition, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

Program::Program(std::vector<std::string> arguments, const std::filesystem::path& log) {
  std::vector<char*> pointers;
  for (auto& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const char* const output = log.c_str();
  process_ = ::fork();
  require(process_ >= 0, "cannot fork");
  if (process_ != 0) return;
  const int file = ::open(output, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  ::dup2(file, STDOUT_FILENO);
  ::dup2(file, STDERR_FILENO);
  ::execvp(pointers[0], pointers.data());
  ::_exit(127);
}

void Program::end(int signal) {
  if (process_ < 0) return;
  ::kill(process_, signal);
  ::waitpid(process_, nullptr, 0);
  process_ = -1;
}

void Program::send(int signal) const { ::kill(process_, signal); }

Mosquitto::Mosquitto(const std::string& more) {
  static_cast<void>(folder_.file(
      "mosquitto.conf", fmt::format("listener {} 127.0.0.1\npersistence true\npersistence_location {}/\n"
                                    "max_queued_messages 1000000\nmax_queued_bytes 0\nlog_dest stderr\n{}\n",
                                    port_, folder_.path().string(), more)));
  if (::geteuid() == 0) {  // else it would take another user, who may not write here
    std::ofstream(folder_ / "mosquitto.conf", std::ios::app) << "user root\n";
  }
  start();
}

void Mosquitto::start() {
  look_in_sbin();
  program_ = std::make_unique<Program>(
      std::vector<std::string>{"mosquitto", "-c", (folder_ / "mosquitto.conf").string()}, folder_ / "log");
  require(until([this] { return listens(port_); }),
          "mosquitto does not listen: " + resonid::test::contents_of(folder_ / "log"));
}

NatsServer::NatsServer(const std::string& more) {
  static_cast<void>(folder_.file(
      "nats.conf",
      fmt::format("listen: 127.0.0.1:{}\njetstream {{ store_dir: \"{}\" }}\nmax_payload: 2000000\n{}\n",
                  port_, folder_.path().string(), more)));
  start();
}

void NatsServer::start() {
  look_in_sbin();
  program_ = std::make_unique<Program>(
      std::vector<std::string>{"nats-server", "-c", (folder_ / "nats.conf").string()}, folder_ / "log");
  require(until([this] { return listens(port_); }),
          "nats-server does not listen: " + resonid::test::contents_of(folder_ / "log"));
}

double value_of(std::uint64_t sample, std::size_t column) {
  return column == 0 ? static_cast<double>(sample)
                     : static_cast<double>((sample * (column == 1 ? 7 : 13)) % 10007);
}

std::string frame_of(std::string_view axis, std::uint64_t first, std::size_t samples, double rate_hz) {
  static constexpr std::string_view kNames[] = {"ru", "u", "y"};
  std::vector<double> values;
  for (std::size_t k = 0; k < samples; ++k)
    for (std::size_t c = 0; c < 3; ++c) values.push_back(value_of(first + k, c));
  Arrival arrival{axis,    first,  kStart_ns + std::llround(1e9 / rate_hz * static_cast<double>(first)),
                  rate_hz, kNames, values,
                  {}};
  return encoded(arrival, ValueType::float32).value();
}

void make_certificate(const TemporaryFolder& folder, const std::string& name) {
  Program({"openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
           "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout",
           (folder / (name + ".key")).string(), "-out", (folder / (name + ".pem")).string()})
      .end(0);
}

std::string with_tls(const TemporaryFolder& folder) {
  for (const char* name : {"right", "wrong"}) make_certificate(folder, name);
  return fmt::format(R"(tls {{ cert_file: "{}", key_file: "{}" }})", (folder / "right.pem").string(),
                     (folder / "right.key").string());
}

Rings::Rings(const std::filesystem::path& folder, const std::vector<std::string>& names,
             std::uint64_t capacity) {
  for (const auto& name : names) {
    std::string file = name + ".ring";
    for (char& c : file)
      if (c == '/') c = '_';
    auto ring = Ring::open(folder / file, {name, ring_channels(kColumns), kRate_hz, capacity});
    require(ring.has_value(), ring ? "" : ring.error().requirement.str());
    Axis& axis = axes_[name];
    axis.ring = std::move(*ring);
    axis.intake = std::make_unique<Intake>(*axis.ring, kColumns);
    all_.push_back(axis.intake.get());
  }
}

Intake* Rings::find(std::string_view name) {
  const auto axis = axes_.find(name);
  return axis == axes_.end() ? nullptr : axis->second.intake.get();
}

void expect_stored(Ring& ring, std::uint64_t count) {
  ASSERT_EQ(ring.end(), count);
  ASSERT_EQ(ring.next_sample(), count);
  std::uint64_t wrong = 0;
  for (std::uint64_t position = ring.begin(); position < ring.end();) {
    const Piece piece = ring.piece(position);
    for (std::size_t k = 0; k < piece.samples; ++k)
      for (std::size_t c = 0; c < 3; ++c)
        wrong +=
            piece.values[3 * k + c] != value_of(position + k, c) || piece.first_sample + k != position + k;
    position += piece.samples;
  }
  EXPECT_EQ(wrong, 0U);
}

MqttSender::MqttSender(std::uint16_t port, const std::string& authorities) : client_(nullptr) {
  mosquitto_lib_init();
  client_ = mosquitto_new(nullptr, true, this);
  mosquitto_publish_callback_set(
      client_, [](mosquitto*, void* self, int) { ++static_cast<MqttSender*>(self)->acknowledged_; });
  mosquitto_max_inflight_messages_set(client_, 100);
  if (!authorities.empty())
    mosquitto_tls_set(client_, authorities.c_str(), nullptr, nullptr, nullptr, nullptr);
  require(mosquitto_connect(client_, "127.0.0.1", port, 60) == MOSQ_ERR_SUCCESS, "cannot connect");
  mosquitto_loop_start(client_);
}

MqttSender::~MqttSender() {
  mosquitto_disconnect(client_);
  mosquitto_loop_stop(client_, false);
  mosquitto_destroy(client_);
}

void MqttSender::send(const std::string& topic, std::string_view payload) {
  require(mosquitto_publish(client_, nullptr, topic.c_str(), static_cast<int>(payload.size()), payload.data(),
                            1, false) == MOSQ_ERR_SUCCESS,
          "cannot publish");
  ++sent_;
}

void MqttSender::finish() {
  require(until([this] { return acknowledged_ == sent_; }, 60.0), "the broker did not acknowledge all");
}

NatsSender::NatsSender(const std::string& url, const std::string& authorities) {
  natsOptions* options = nullptr;
  require(natsOptions_Create(&options));
  require(natsOptions_SetURL(options, url.c_str()));
  if (!authorities.empty()) require(natsOptions_LoadCATrustedCertificates(options, authorities.c_str()));
  const natsStatus status = natsConnection_Connect(&connection_, options);
  natsOptions_Destroy(options);
  require(status);
  require(natsConnection_JetStream(&js_, connection_, nullptr));
}

NatsSender::~NatsSender() {
  jsCtx_Destroy(js_);
  natsConnection_Destroy(connection_);
}

void NatsSender::make_stream(const char* name, const char* subjects) {
  jsStreamConfig config;
  jsStreamConfig_Init(&config);
  config.Name = name;
  config.Subjects = &subjects;
  config.SubjectsLen = 1;
  require(js_AddStream(nullptr, js_, &config, nullptr, nullptr));
}

void NatsSender::delete_stream(const char* name) { require(js_DeleteStream(js_, name, nullptr, nullptr)); }

void NatsSender::store(const std::string& subject, std::string_view payload) {
  natsStatus status = NATS_ERR;
  for (int attempt = 0; attempt < 10 && status != NATS_OK; ++attempt)
    status = js_Publish(nullptr, js_, subject.c_str(), payload.data(), static_cast<int>(payload.size()),
                        nullptr, nullptr);
  require(status);
}

void NatsSender::send(const std::string& subject, std::string_view payload) {
  require(
      natsConnection_Publish(connection_, subject.c_str(), payload.data(), static_cast<int>(payload.size())));
}

void NatsSender::flush() { require(natsConnection_FlushTimeout(connection_, 10'000)); }

std::unique_ptr<Source> mqtt_source(std::uint16_t port, Axes& axes, int version) {
  MqttSourceSettings settings;
  settings.broker.host = "127.0.0.1";
  settings.broker.port = port;
  settings.broker.version = version == 5 ? MqttVersion::v5 : MqttVersion::v3_1_1;
  settings.broker.client_id = "resonid-test";
  settings.topics = {{"machines/+/samples", {SampleFormat::frame}}};
  auto source = make_mqtt_source(std::move(settings), axes);
  require(source.has_value(), "no MQTT source");
  return std::move(*source);
}

std::unique_ptr<Source> jetstream_source(const std::string& url, Axes& axes, const std::string& filter) {
  JetStreamSourceSettings settings;
  settings.servers.servers = {url};
  settings.stream = "SAMPLES";
  settings.consumer = "resonid";
  settings.subjects = {filter, {SampleFormat::frame}};
  auto source = make_jetstream_source(std::move(settings), axes);
  require(source.has_value(), "no JetStream source");
  return std::move(*source);
}

}  // namespace resonid::monitor::test

// SPDX-License-Identifier: MIT
// docs/monitor_frame.md and the clients in examples/monitor, which were written without this decoder.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "../io/temporary_folder.hpp"
#include "monitor/samples/frame.hpp"
#include "monitor/samples/intake.hpp"

namespace resonid::monitor {
namespace {

/// The bytes of each listing of a document.
std::vector<std::string> listings(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> all;
  bool within = false;
  for (std::string line; std::getline(file, line);) {
    const bool bytes = line.size() > 10 && line.substr(0, 4) == "    " && line.substr(8, 2) == ": ";
    if (bytes && !within) all.emplace_back();
    within = bytes;
    if (!bytes) continue;
    std::istringstream numbers(line.substr(10));
    for (unsigned byte = 0; numbers >> std::hex >> byte;) all.back() += static_cast<char>(byte);
  }
  return all;
}

TEST(FrameDocument, ItsExamplesAreReadAndWrittenAsItTells) {
  const auto examples = listings(RESONID_FRAME_DOCUMENT);
  ASSERT_EQ(examples.size(), 3U);
  FaultLog faults;
  FrameDecoder decoder(faults);
  int frames = 0, questions = 0, answers = 0;
  for (const auto& bytes : examples)
    decoder.add(bytes, [&](const Message& message) {
      if (const auto* a = std::get_if<Arrival>(&message)) {
        ++frames;
        EXPECT_EQ(a->axis, "x");
        EXPECT_EQ(a->first_sample, 1000U);
        EXPECT_EQ(a->sample_rate_hz, 2000.0);
        EXPECT_EQ(a->time_ns, 1'790'000'000'000'000'000);
        EXPECT_EQ(std::vector<std::string_view>(a->columns.begin(), a->columns.end()),
                  (std::vector<std::string_view>{"u", "y"}));
        EXPECT_EQ(std::vector<double>(a->values.begin(), a->values.end()),
                  (std::vector<double>{0.5, -1.0, 0.25, 2.0}));
        EXPECT_EQ(encoded(*a, ValueType::float32).value(), bytes);
      } else if (const auto* q = std::get_if<Question>(&message)) {
        ++questions;
        EXPECT_EQ(q->axis, "x");
        EXPECT_EQ(encoded(*q), bytes);
      } else {
        ++answers;
        EXPECT_EQ(std::get<Acknowledgement>(message).next_sample, 1002U);
        EXPECT_EQ(encoded(std::get<Acknowledgement>(message)), bytes);
      }
    });
  EXPECT_EQ(frames + 10 * questions + 100 * answers, 111);
  EXPECT_EQ(faults.total(), 0U);
}

/// Serves one client program until it ends; closes the connection after every third frame, sometimes before
/// it is acknowledged.
void serve(const std::vector<std::string>& program, Ring& ring) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ::sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<::sockaddr*>(&address);
  ASSERT_EQ(::bind(listener, generic, size), 0);
  ASSERT_EQ(::listen(listener, 4), 0);
  ASSERT_EQ(::getsockname(listener, generic, &size), 0);
  const ::timeval patience{20, 0};
  ::setsockopt(listener, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);

  std::vector<std::string> words = program;
  words.insert(words.end(), {"127.0.0.1", std::to_string(ntohs(address.sin_port)), "belt-1", "10"});
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const ::pid_t child = ::fork();
  if (child == 0) {
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  Intake intake(ring, {"ru", "u", "y", ""});
  int frames = 0;
  while (ring.end() < 1000) {
    const int client = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    ASSERT_GE(client, 0) << "no client came";
    ::setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    FrameDecoder decoder(intake.faults());
    bool open = true;
    std::array<char, 4096> bytes{};
    while (open) {
      const ::ssize_t got = ::recv(client, bytes.data(), bytes.size(), 0);
      if (got <= 0) break;
      decoder.add({bytes.data(), static_cast<std::size_t>(got)}, [&](const Message& message) {
        if (const auto* arrival = std::get_if<Arrival>(&message)) {
          EXPECT_EQ(arrival->axis, "belt-1");
          EXPECT_EQ(intake.add(*arrival) == Intake::Outcome::refused, false);
          open = ++frames % 3 != 0 || ring.end() >= 1000;
        }
        if (!open && frames % 2 == 0) return;  // taken, and not acknowledged
        const std::string answer = encoded(Acknowledgement{"belt-1", intake.next_for_sender()});
        EXPECT_EQ(::send(client, answer.data(), answer.size(), MSG_NOSIGNAL),
                  static_cast<::ssize_t>(answer.size()));
      });
    }
    ::close(client);
  }
  ::close(listener);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << program[0];
  EXPECT_EQ(intake.faults().total(), 0U);
  EXPECT_EQ(intake.counters().missing, 0U);
}

class FrameClients : public ::testing::TestWithParam<std::vector<std::string>> {};

TEST_P(FrameClients, LoseNothingWhenTheConnectionBreaks) {
  const test::TemporaryFolder folder;
  auto ring = Ring::open(folder / "x.ring", {"belt-1", {"excitation", "input", "output"}, 2000.0, 20'000});
  ASSERT_TRUE(ring);
  serve(GetParam(), **ring);
  const Piece piece = (*ring)->piece(0);
  ASSERT_EQ(piece.samples, 1000U);
  EXPECT_EQ(piece.first_sample, 0U);
  for (std::size_t k = 0; k < 1000; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      ASSERT_EQ(piece.values[3 * k + c], static_cast<double>(k) + 0.25 * static_cast<double>(c));
}

INSTANTIATE_TEST_SUITE_P(InC, FrameClients,
                         ::testing::Values(std::vector<std::string>{RESONID_SEND_SAMPLES_C}));
INSTANTIATE_TEST_SUITE_P(InPython, FrameClients,
                         ::testing::Values(std::vector<std::string>{RESONID_PYTHON,
                                                                    RESONID_SEND_SAMPLES_PY}));

}  // namespace
}  // namespace resonid::monitor

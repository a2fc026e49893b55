// SPDX-License-Identifier: MIT
// The clients in examples/monitor against a server that uses nothing of what they send.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <limits>
#include <string>
#include <vector>

#include "monitor/samples/frame.hpp"

namespace resonid::monitor {
namespace {

using namespace std::chrono_literals;

struct Heard {
  int frames = 0;
  std::string said;  // on standard error
};

/// Answers everything for a second with the same index; then the client is killed where it has not ended.
Heard served(std::vector<std::string> words, std::uint64_t index) {
  Heard heard;
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ::sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<::sockaddr*>(&address);
  EXPECT_EQ(::bind(listener, generic, size) | ::listen(listener, 1), 0);
  EXPECT_EQ(::getsockname(listener, generic, &size), 0);
  ::timeval patience{20, 0};
  ::setsockopt(listener, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::array<int, 2> errors{};
  EXPECT_EQ(::pipe(errors.data()), 0);

  words.insert(words.end(), {"127.0.0.1", std::to_string(ntohs(address.sin_port)), "belt-1", "10"});
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const ::pid_t child = ::fork();
  if (child == 0) {
    ::dup2(errors[1], STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(errors[1]);
  const int client = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
  EXPECT_GE(client, 0) << "no client came";
  patience = {0, 50'000};
  ::setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  FaultLog faults;
  FrameDecoder decoder(faults);
  std::array<char, 4096> bytes{};
  const auto end = std::chrono::steady_clock::now() + 1s;
  bool ended = false;
  while (!ended && std::chrono::steady_clock::now() < end) {
    const ::ssize_t got = ::recv(client, bytes.data(), bytes.size(), 0);
    ended = got == 0;
    if (got <= 0) continue;
    decoder.add({bytes.data(), static_cast<std::size_t>(got)}, [&](const Message& message) {
      heard.frames += std::holds_alternative<Arrival>(message) ? 1 : 0;
      const std::string answer = encoded(Acknowledgement{"belt-1", index});
      ::send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
    });
  }
  ::close(listener);
  ::close(client);
  if (!ended) ::kill(child, SIGKILL);
  for (::ssize_t got = 0; (got = ::read(errors[0], bytes.data(), bytes.size())) > 0;)
    heard.said.append(bytes.data(), static_cast<std::size_t>(got));
  ::close(errors[0]);
  ::waitpid(child, nullptr, 0);
  return heard;
}

class RefusedClients : public ::testing::TestWithParam<std::vector<std::string>> {};

TEST_P(RefusedClients, PauseAndSaySo) {
  const Heard heard = served(GetParam(), 0);
  EXPECT_GE(heard.frames, 1);
  EXPECT_LE(heard.frames, 6);
  EXPECT_NE(heard.said.find("took nothing"), std::string::npos) << heard.said;
}

TEST_P(RefusedClients, EndWhereTheirAxisIsNotTaken) {
  const Heard heard = served(GetParam(), std::numeric_limits<std::uint64_t>::max());
  EXPECT_LE(heard.frames, 1);
  EXPECT_NE(heard.said.find("takes no samples of axis belt-1"), std::string::npos) << heard.said;
  EXPECT_EQ(heard.said.find("again"), std::string::npos) << heard.said;
}

INSTANTIATE_TEST_SUITE_P(InC, RefusedClients,
                         ::testing::Values(std::vector<std::string>{RESONID_SEND_SAMPLES_C}));
INSTANTIATE_TEST_SUITE_P(InPython, RefusedClients,
                         ::testing::Values(std::vector<std::string>{RESONID_PYTHON,
                                                                    RESONID_SEND_SAMPLES_PY}));

}  // namespace
}  // namespace resonid::monitor

// SPDX-License-Identifier: MIT
#include "monitor/sources/tcp_source.hpp"

#include <sys/wait.h>

#include <ctime>
#include <fstream>

#include "client.hpp"
#include "installation.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;

TcpSettings on_any_port() {
  TcpSettings settings;
  settings.address = "127.0.0.1:0";
  return settings;
}

std::unique_ptr<NetworkSource> started(TcpSettings settings, Axes& axes) {
  auto source = required(make_tcp_source(std::move(settings), axes));
  source->start();
  EXPECT_TRUE(eventually([&] { return source->status().state == SourceState::running; }));
  return source;
}

TEST(TcpSource, AnswersFramesAndQuestionsOfBothFamilies) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x", "y"});
  TcpSettings settings = on_any_port();
  settings.address = ":0";
  const auto source = started(settings, axes);
  const Client v4(source->bound_port()), v6(source->bound_port(), SOCK_STREAM, AF_INET6);
  ASSERT_TRUE(v4.send(encoded(Question{"x"})));
  EXPECT_EQ(v4.next_sample("x"), 0U);
  ASSERT_TRUE(v4.send(frame_of("x", 0, 100) + frame_of("x", 100, 50)));
  EXPECT_EQ(v4.next_sample("x"), 100U);
  EXPECT_EQ(v4.next_sample("x"), 150U);
  axes.expect_exactly("x", 150);  // what was acknowledged is there
  ASSERT_TRUE(v6.send(encoded(Question{"x"}) + frame_of("y", 0, 3) + encoded(Question{"nobody"}) +
                      frame_of("nobody", 0, 3)));
  EXPECT_EQ(v6.next_sample("x"), 150U);
  EXPECT_EQ(v6.next_sample("y"), 3U);
  EXPECT_EQ(v6.next_sample("nobody"), Acknowledgement::kRefused);
  EXPECT_EQ(v6.next_sample("nobody"), Acknowledgement::kRefused);
  EXPECT_EQ(source->status().unknown, 1U);
}

TEST(TcpSource, ListensOnAUnixSocketAlsoWhereAKilledOneWas) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  TcpSettings settings = on_any_port();
  const std::string path = (folder / "socket").string();
  settings.address = "unix:" + path;
  {
    const ::pid_t child = ::fork();
    if (child == 0) {
      const auto source = started(settings, axes);
      ::raise(SIGKILL);
    }
    ::waitpid(child, nullptr, 0);
  }
  ASSERT_TRUE(std::filesystem::exists(path));
  {
    const auto source = started(settings, axes);
    const Client client(path);
    ASSERT_TRUE(client.send(frame_of("x", 0, 10)));
    EXPECT_EQ(client.next_sample("x"), 10U);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  std::ofstream(path) << "a file";
  const auto source = required(make_tcp_source(settings, axes));
  source->start();
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_EQ(test::contents_of(path), "a file");
}

TEST(TcpSource, TakesFramesByteByByteAndBetweenGarbage) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started(on_any_port(), axes);
  const Client client(source->bound_port());
  for (const char byte : "noise" + frame_of("x", 0, 5) + "RSN1RSNQ" + frame_of("x", 5, 5))
    ASSERT_TRUE(client.send({&byte, 1}));
  EXPECT_EQ(client.next_sample("x"), 5U);
  EXPECT_EQ(client.next_sample("x"), 10U);
  axes.expect_exactly("x", 10);
  EXPECT_GE(axes.intake("x").faults().count(Fault::format), 1U);
}

TEST(TcpSource, CountsWhatCannotBeUsedAndDoesNotAcknowledgeIt) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started(on_any_port(), axes);
  const Client client(source->bound_port());
  ASSERT_TRUE(client.send(frame_of("x", 0, 10) + frame_of("x", 10, 10, 500.0)));  // wrong rate
  EXPECT_EQ(client.next_sample("x"), 10U);
  EXPECT_EQ(client.next_sample("x"), 10U);
  ASSERT_TRUE(client.send(frame_of("x", 5, 10) + frame_of("x", 0, 10)));  // half known; reversed
  EXPECT_EQ(client.next_sample("x"), 15U);
  EXPECT_EQ(client.next_sample("x"), 15U);
  axes.expect_exactly("x", 15);
  EXPECT_EQ(axes.intake("x").counters().duplicate, 15U);
  EXPECT_EQ(axes.intake("x").faults().count(Fault::rate), 1U);
}

TEST(TcpSource, HalfALineOfAConnectionThatBreaksIsAFaultAndNoSample) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  TcpSettings settings = on_any_port();
  settings.format = Format{SampleFormat::csv, {"sample", "u", "y"}};
  const auto source = started(settings, axes);
  {
    const Client client(source->bound_port());
    ASSERT_TRUE(client.send("0,0,0\n1,0.5,-1\n2,1,-"));
    client.shut_down_sending();
    EXPECT_TRUE(client.is_closed());
  }
  EXPECT_EQ(axes.intake("x").faults().count(Fault::format), 1U);
  const Client client(source->bound_port());
  ASSERT_TRUE(client.send("2,1,-2\n3,1.5,-3\n"));
  client.shut_down_sending();
  EXPECT_TRUE(client.is_closed());
  axes.expect_exactly("x", 4);
  EXPECT_EQ(axes.intake("x").faults().total(), 1U);
  EXPECT_EQ(axes.intake("x").counters().duplicate, 0U);
}

TEST(TcpSource, AnswersAClientThatSendsNoMore) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started(on_any_port(), axes);
  const Client client(source->bound_port());
  ASSERT_TRUE(client.send(frame_of("x", 0, 10)));
  client.shut_down_sending();
  EXPECT_EQ(client.next_sample("x"), 10U);
}

TEST(TcpSource, SlowAndVanishingClientsHoldUpNobody) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x", "y"});
  const auto source = started(on_any_port(), axes);
  const std::string frame = frame_of("y", 0, 100);
  const Client slow(source->bound_port()), other(source->bound_port());
  ASSERT_TRUE(slow.send(frame.substr(0, 100)));
  for (std::uint64_t k = 0; k < 100; ++k) {
    Client vanishing(source->bound_port());
    ASSERT_TRUE(vanishing.send(frame.substr(0, 10 + 2 * k)));
    if (k % 2 == 0) vanishing.break_off();
    ASSERT_TRUE(other.send(frame_of("x", 10 * k, 10)));
    ASSERT_EQ(other.next_sample("x"), 10 * k + 10);
  }
  ASSERT_TRUE(slow.send(frame.substr(100)));
  EXPECT_EQ(slow.next_sample("y"), 100U);
  axes.expect_exactly("x", 1000);
  axes.expect_exactly("y", 100);
}

TEST(TcpSource, OnlyClientsOfAFullRingWait) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x", "y"}, 8192);
  const auto source = started(on_any_port(), axes);
  const Client full(source->bound_port()), other(source->bound_port());
  std::string frames;
  for (std::uint64_t k = 0; k < 20'000; k += 100) frames += frame_of("x", k, 100);
  std::jthread sender([&] { EXPECT_TRUE(full.send(frames + encoded(Question{"y"}))); });
  ASSERT_TRUE(eventually([&] { return source->status().text.find("1 wait for room") != std::string::npos; }));
  for (std::uint64_t k = 0; k < 10; ++k) {
    ASSERT_TRUE(other.send(frame_of("y", 10 * k, 10)));
    ASSERT_EQ(other.next_sample("y"), 10 * k + 10);
  }
  EXPECT_LT(axes.end("x"), 8192U);
  const std::clock_t before = std::clock();
  pause_ms(300);
  EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 0.15) << "it must not spin";
  std::uint64_t next = 0, acknowledged = 0;
  while (next < 20'000) {
    const Piece piece = axes.ring("x").piece(next);
    for (std::size_t k = 0; k < piece.samples; ++k)
      ASSERT_EQ(piece.values[2 * k + 1], -static_cast<double>(next + k));
    next += piece.samples;
    axes.ring("x").set_read(next);
    while (acknowledged < next) {
      const auto answer = full.next_sample("x");
      ASSERT_EQ(answer, acknowledged + 100);
      acknowledged = *answer;
    }
  }
  EXPECT_EQ(full.next_sample("y"), 100U);  // answered in its turn
  sender.join();
  EXPECT_EQ(axes.intake("x").counters().lost, 0U);
}

TEST(TcpSource, AClientThatReadsNoAnswersIsNotReadFrom) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  TcpSettings settings = on_any_port();
  settings.idle_s = 3.0;
  const auto source = started(settings, axes);
  const Client deaf(source->bound_port());
  deaf.set_timeout_ms(100);
  std::string questions;
  for (int k = 0; k < 5000; ++k) questions += encoded(Question{"x"});
  int sent = 0;
  while (sent < 2000 && deaf.send(questions)) ++sent;
  EXPECT_LT(sent, 2000) << "answers of 320 MB would be kept";
  const Client other(source->bound_port());
  ASSERT_TRUE(other.send(frame_of("x", 0, 10)));
  EXPECT_EQ(other.next_sample("x"), 10U);
  EXPECT_TRUE(eventually([&] { return source->status().text.starts_with("0 clients"); }));
}

TEST(TcpSource, ClosesWhoSendsNothing) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  TcpSettings settings = on_any_port();
  settings.idle_s = 0.1;
  const auto source = started(settings, axes);
  const Client client(source->bound_port());
  EXPECT_TRUE(client.is_closed());
}

TEST(TcpSource, ClosesWhoNeverCompletesAMessage) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started(on_any_port(), axes);
  const Client client(source->bound_port());
  const std::string garbage(100'000, 'x');
  int sent = 0;
  while (sent < 1000 && client.send(garbage)) ++sent;
  EXPECT_LT(sent, 1000);
  EXPECT_EQ(axes.intake("x").faults().count(Fault::size), 1U);
}

TEST(TcpSource, KeepsOnlySoManyUnfinishedBytesOfAllClients) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"}, 1U << 19U);
  TcpSettings settings = on_any_port();
  settings.most_unfinished = 2'000'000;
  const auto source = started(settings, axes);
  const std::string frame = frame_of("x", 0, 60'000);
  std::vector<Client> greedy;
  for (int k = 0; k < 5; ++k) {
    greedy.emplace_back(source->bound_port());
    static_cast<void>(greedy.back().send(frame.substr(0, 900'000)));
  }
  const Client other(source->bound_port());
  ASSERT_TRUE(other.send(frame_of("x", 0, 10)));
  EXPECT_EQ(other.next_sample("x"), 10U);
  EXPECT_TRUE(eventually([&] { return axes.intake("x").faults().count(Fault::size) == 3; }));
}

TEST(TcpSource, ServesAThousandClientsAndTurnsAwayMore) {
  constexpr std::uint64_t kClients = 1000, kAxes = 10;
  const TemporaryFolder folder;
  std::vector<std::string> names;
  for (std::uint64_t a = 0; a < kAxes; ++a) names.push_back("axis" + std::to_string(a));
  Installation axes(folder.path(), names);
  TcpSettings settings = on_any_port();
  settings.most_connections = 1000;
  const auto source = started(settings, axes);
  std::vector<Client> clients;
  for (std::uint64_t k = 0; k < kClients; ++k) {
    clients.emplace_back(source->bound_port());
    ASSERT_TRUE(clients.back().connected()) << k;
  }
  for (int round = 0; round < 2; ++round)
    for (std::uint64_t k = 0; k < kClients; ++k) {
      const std::string& axis = names[k % kAxes];
      const std::uint64_t first = 10 * (k / kAxes + static_cast<std::uint64_t>(round) * kClients / kAxes);
      ASSERT_TRUE(clients[k].send(frame_of(axis, first, 10)));
      ASSERT_EQ(clients[k].next_sample(axis), first + 10) << k;
    }
  for (const std::string& axis : names) axes.expect_exactly(axis, 2000);
  for (std::uint64_t k = 0; k < 9000; ++k) {
    const Client one_more(source->bound_port());
    if (k % 1000 > 0) continue;
    EXPECT_TRUE(one_more.is_closed());
    const std::uint64_t first = 2000 + k / 100;
    ASSERT_TRUE(clients[0].send(frame_of(names[0], first, 10)));
    ASSERT_EQ(clients[0].next_sample(names[0]), first + 10);
  }
  EXPECT_TRUE(eventually([&] {
    return source->status().text.find("9000 turned away (at most 1000)") != std::string::npos;
  })) << source->status().text;
}

TEST(TcpSource, AUsefulClientTakesThePlaceOfASilentOne) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  TcpSettings settings = on_any_port();
  settings.most_connections = 2;
  const auto source = started(settings, axes);
  const Client first(source->bound_port());
  ASSERT_TRUE(first.send(frame_of("x", 0, 10)));
  EXPECT_EQ(first.next_sample("x"), 10U);
  const Client silent(source->bound_port());
  const auto turned_away = [&] { return source->status().faults[static_cast<std::size_t>(Fault::size)]; };
  EXPECT_EQ(turned_away(), 0U);
  EXPECT_TRUE(Client(source->bound_port()).is_closed());  // the silent one may be about to send
  EXPECT_TRUE(eventually([&] { return turned_away() == 1; }));
  pause_ms(1100);
  const Client third(source->bound_port());
  ASSERT_TRUE(third.send(frame_of("x", 10, 10)));
  EXPECT_EQ(third.next_sample("x"), 20U);
  EXPECT_TRUE(silent.is_closed());
  EXPECT_TRUE(eventually([&] { return turned_away() == 2; })) << source->status().text;
  ASSERT_TRUE(first.send(frame_of("x", 20, 10)));
  EXPECT_EQ(first.next_sample("x"), 30U);
}

TEST(TcpSource, TakesWhatTheExampleInPythonSends) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"}, 1U << 16U, {"ru", "u", "y", ""}, 2000.0);
  const auto source = started(on_any_port(), axes);
  const std::string command = std::string(RESONID_PYTHON) + " " + RESONID_SEND_SAMPLES_PY + " 127.0.0.1 " +
                              std::to_string(source->bound_port()) + " x 20";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto stored = axes.stored("x");
  ASSERT_EQ(stored.sample.size(), 2000U);
  for (std::size_t k = 0; k < 2000; ++k) {
    const auto value = static_cast<double>(k % 1000);
    ASSERT_EQ(stored.values[k], (std::vector<double>{value, value + 0.25, value + 0.5}));
  }
}

TEST(TcpSource, RefusesWhatCannotBe) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {});
  for (const std::string& text : {std::string("nothing"), std::string("unix:"), std::string("unix:relative"),
                                  "unix:/" + std::string(200, 'a')}) {
    TcpSettings settings = on_any_port();
    settings.address = text;
    RESONID_EXPECT_MESSAGE(make_tcp_source(settings, axes), "address");
  }
  TcpSettings settings = on_any_port();
  settings.most_connections = 0;
  RESONID_EXPECT_MESSAGE(make_tcp_source(settings, axes), "most_connections");
  settings = on_any_port();
  settings.idle_s = std::nan("");
  RESONID_EXPECT_MESSAGE(make_tcp_source(settings, axes), "idle_s");
  settings = on_any_port();
  settings.most_without_message = 1000;
  RESONID_EXPECT_MESSAGE(make_tcp_source(settings, axes), "most_without_message");
  settings = on_any_port();
  settings.most_unfinished = 1000;
  RESONID_EXPECT_MESSAGE(make_tcp_source(settings, axes), "most_unfinished");
}

}  // namespace
}  // namespace resonid::monitor

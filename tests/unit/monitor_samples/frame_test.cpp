// SPDX-License-Identifier: MIT
#include "monitor/samples/frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include "monitor/samples/crc32c.hpp"

namespace resonid::monitor {
namespace {

/// Messages with what they point to.
struct Taken {
  std::string axis;
  std::vector<std::string> columns;
  std::vector<double> values;
  Arrival arrival;
};

struct Receiver {
  FaultLog faults;
  FrameDecoder decoder{faults};
  std::vector<Taken> frames;
  std::vector<std::string> questions;
  std::vector<std::pair<std::string, std::uint64_t>> answers;

  void add(std::string_view bytes) {
    decoder.add(bytes, [&](const Message& message) {
      if (const auto* arrival = std::get_if<Arrival>(&message)) {
        Taken taken{
            std::string(arrival->axis), {}, {arrival->values.begin(), arrival->values.end()}, *arrival};
        for (const auto name : arrival->columns) taken.columns.emplace_back(name);
        frames.push_back(std::move(taken));
      } else if (const auto* question = std::get_if<Question>(&message)) {
        questions.emplace_back(question->axis);
      } else {
        const auto& answer = std::get<Acknowledgement>(message);
        answers.emplace_back(answer.axis, answer.next_sample);
      }
    });
  }
};

const std::vector<std::string_view> kColumns = {"ru", "u", "y"};

Arrival some(std::uint64_t first, const std::vector<double>& values) {
  Arrival arrival{
      .axis = "x", .first_sample = first, .time_ns = {}, .columns = kColumns, .values = values, .ends = {}};
  arrival.sample_rate_hz = 2000.0;
  return arrival;
}

std::string frame(std::uint64_t first, std::size_t samples = 4, ValueType type = ValueType::float64) {
  std::vector<double> values(3 * samples);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<double>(first) + 0.25 * static_cast<double>(i);
  return encoded(some(first, values), type).value();
}

TEST(Crc32c, IsThatOfTheStandard) {  // RFC 3720, appendix B.4
  EXPECT_EQ(crc32c("123456789"), 0xE3069283U);
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8A9136AAU);
  EXPECT_EQ(crc32c(std::string(32, '\xff')), 0x62A8AB43U);
  std::string ascending;
  for (int i = 0; i < 32; ++i) ascending += static_cast<char>(i);
  EXPECT_EQ(crc32c(ascending), 0x46DD794EU);
  EXPECT_EQ(crc32c(""), 0U);
}

TEST(Frame, GivesBackWhatWasSent) {
  Receiver receiver;
  const std::vector<double> values = {1.5, -2.25, 1e300, std::nan(""), 0.1, -0.0};
  Arrival sent = some(7, values);
  sent.time_ns = 1'790'000'000'123'456'789;
  receiver.add(encoded(sent, ValueType::float64).value());
  ASSERT_EQ(receiver.frames.size(), 1U);
  const Taken& got = receiver.frames.front();
  EXPECT_EQ(got.axis, "x");
  EXPECT_EQ(got.columns, (std::vector<std::string>{"ru", "u", "y"}));
  EXPECT_EQ(got.arrival.first_sample, 7U);
  EXPECT_EQ(got.arrival.time_ns, sent.time_ns);
  EXPECT_EQ(got.arrival.sample_rate_hz, 2000.0);
  ASSERT_EQ(got.values.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_TRUE(got.values[i] == values[i] || (std::isnan(values[i]) && std::isnan(got.values[i]))) << i;
  EXPECT_EQ(receiver.faults.total(), 0U);
}

TEST(Frame, Float32IsRoundedOnce) {
  Receiver receiver;
  const std::vector<double> values = {0.1, 2.0, -3.5};
  receiver.add(encoded(some(0, values), ValueType::float32).value());
  ASSERT_EQ(receiver.frames.size(), 1U);
  EXPECT_EQ(receiver.frames[0].values, (std::vector<double>{static_cast<double>(0.1F), 2.0, -3.5}));
}

TEST(Frame, WhatIsNotToldStaysUntold) {
  Receiver receiver;
  const std::vector<double> values = {1.0, 2.0, 3.0};
  Arrival sent = some(0, values);
  sent.first_sample.reset();
  sent.sample_rate_hz = 0.0;
  sent.axis = "";
  receiver.add(encoded(sent, ValueType::float32).value());
  ASSERT_EQ(receiver.frames.size(), 1U);
  EXPECT_FALSE(receiver.frames[0].arrival.first_sample);
  EXPECT_FALSE(receiver.frames[0].arrival.time_ns);
  EXPECT_EQ(receiver.frames[0].axis, "");
}

TEST(Frame, QuestionsAndAnswersPass) {
  for (const std::string axis : {"", "x", "plant-2.axis_1"}) {
    Receiver receiver;
    receiver.add(encoded(Question{axis}) + encoded(Acknowledgement{axis, 123'456'789'012}));
    EXPECT_EQ(receiver.questions, std::vector<std::string>{axis});
    ASSERT_EQ(receiver.answers.size(), 1U);
    EXPECT_EQ(receiver.answers[0], std::pair(axis, std::uint64_t{123'456'789'012}));
    EXPECT_EQ(encoded(Question{axis}).size() % 8, 4U);
  }
}

TEST(Frame, ArrivesInPiecesOfAnySize) {
  std::string stream;
  for (std::uint64_t k = 0; k < 20; ++k)
    stream += frame(4 * k, 4, k % 2 == 0 ? ValueType::float32 : ValueType::float64);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{3}, std::size_t{47}, std::size_t{1000}}) {
    Receiver receiver;
    for (std::size_t at = 0; at < stream.size(); at += piece)
      receiver.add(std::string_view(stream).substr(at, piece));
    ASSERT_EQ(receiver.frames.size(), 20U) << piece;
    for (std::uint64_t k = 0; k < 20; ++k) {
      EXPECT_EQ(receiver.frames[k].arrival.first_sample, 4 * k);
      EXPECT_EQ(receiver.frames[k].values[5], static_cast<double>(4 * k) + 1.25);
    }
    EXPECT_EQ(receiver.faults.total(), 0U);
  }
}

TEST(Frame, GoesOnAfterGarbage) {
  std::mt19937 random(1);
  for (int run = 0; run < 300; ++run) {
    Receiver receiver;
    std::string garbage(random() % 200, '\0');
    for (char& c : garbage) c = run % 2 == 0 ? static_cast<char>(random()) : "RSN1"[random() % 4];
    if (run % 5 == 0) garbage += frame(1).substr(0, 1 + random() % 100);  // its writer was killed
    receiver.add(frame(0) + garbage + frame(4) + frame(8));
    ASSERT_EQ(receiver.frames.size(), 3U) << run;
    EXPECT_EQ(receiver.frames[1].arrival.first_sample, 4U);
    EXPECT_EQ(receiver.decoder.skipped_bytes(), garbage.size());
    EXPECT_EQ(receiver.faults.count(Fault::format) + receiver.faults.count(Fault::size) > 0,
              !garbage.empty());
  }
}

TEST(Frame, EveryFlippedBitIsFound) {
  const std::string right = frame(0, 2);
  for (std::size_t bit = 0; bit < 8 * right.size(); ++bit) {
    std::string wrong = right;
    wrong[bit / 8] = static_cast<char>(wrong[bit / 8] ^ (1 << (bit % 8)));
    Receiver receiver;
    receiver.add(wrong + frame(2));
    receiver.decoder.finish();
    ASSERT_EQ(receiver.frames.size(), 1U) << bit;
    EXPECT_EQ(receiver.frames[0].arrival.first_sample, 2U);
    EXPECT_GT(receiver.faults.total(), 0U);
  }
}

TEST(Frame, WhatIsRightlySignedButCannotBeIsSkippedWhole) {
  const auto signed_again = [](std::string bytes) {
    bytes.resize(bytes.size() - 4);
    const std::uint32_t crc = crc32c(bytes);
    for (unsigned k = 0; k < 4; ++k) bytes += static_cast<char>(crc >> (8 * k));
    return bytes;
  };
  std::string flags = frame(0);
  flags[43] = 1;
  std::string rate = frame(0);
  rate[31] = '\xbf';  // negative
  std::string name = frame(0);
  name[47] = '\x07';  // length of the first column's name: goes on into the next
  std::string control = frame(0);
  control[46] = '\n';
  for (const auto& wrong : {flags, rate, name, control}) {
    Receiver receiver;
    receiver.add(signed_again(wrong) + frame(4));
    ASSERT_EQ(receiver.frames.size(), 1U);
    EXPECT_EQ(receiver.frames[0].arrival.first_sample, 4U);
    EXPECT_EQ(receiver.faults.count(Fault::format), 1U);
    EXPECT_EQ(receiver.decoder.skipped_bytes(), wrong.size());
  }
}

TEST(Frame, AnUnfinishedDatagramIsAFault) {
  Receiver receiver;
  receiver.add(frame(0).substr(0, 60));
  EXPECT_EQ(receiver.faults.total(), 0U);
  receiver.decoder.finish();
  EXPECT_EQ(receiver.faults.count(Fault::format), 1U);
  receiver.add(frame(4));
  EXPECT_EQ(receiver.frames.size(), 1U);
}

TEST(Frame, HostileLengthsCostNoTimeAndNoMemory) {
  // Headers of frames of nearly a megabyte, one every 56 bytes: read again and again that were 17 GB per
  // megabyte.
  std::string header = frame(0, 41'600, ValueType::float64).substr(0, 56);
  std::string stream;
  while (stream.size() < 4'000'000) stream += header;
  Receiver receiver;
  const std::clock_t begin = std::clock();
  receiver.add(stream);
  receiver.decoder.finish();
  EXPECT_LT(std::clock() - begin, 10 * CLOCKS_PER_SEC);
  EXPECT_TRUE(receiver.frames.empty());
  EXPECT_EQ(receiver.decoder.skipped_bytes(), stream.size());
}

TEST(Frame, ATooLongOneIsAFaultOfSize) {
  std::string bytes = frame(0);
  bytes[10] = '\x7f';
  Receiver receiver;
  receiver.add(bytes);
  EXPECT_EQ(receiver.faults.count(Fault::size), 1U);
  EXPECT_NE(receiver.faults.example(Fault::size).find("1 000 000"), std::string::npos);
}

TEST(Frame, RefusesToEncodeWhatDoesNotFit) {
  const std::vector<double> values(3 * 50'000), half(4);
  EXPECT_EQ(encoded(some(0, values), ValueType::float64).error().field, "values");
  EXPECT_TRUE(encoded(some(0, values), ValueType::float32));
  EXPECT_EQ(encoded(some(0, half), ValueType::float64).error().field, "values");
  Arrival arrival = some(0, half);
  const std::string long_name(256, 'a');
  arrival.axis = long_name;
  arrival.values = {};
  EXPECT_EQ(encoded(arrival, ValueType::float64).error().field, "axis");
  arrival.axis = "x";
  arrival.columns = {};
  EXPECT_EQ(encoded(arrival, ValueType::float64).error().field, "columns");
}

TEST(Faults, ExamplesArePrintable) {
  EXPECT_EQ(printable("a\nb\x7f\x01"), "a?b??");
  EXPECT_EQ(printable("\xff\xfe\x80"), "???");
  EXPECT_EQ(printable("m\xc3\xbc\xe2\x82\xac"), "m\xc3\xbc\xe2\x82\xac");
  EXPECT_EQ(printable("\xc2\x85 next line"), "? next line");
  EXPECT_EQ(printable(std::string(100, 'a')).size(), 80U);
  EXPECT_EQ(printable(std::string(79, 'a') + "\xc3\xbc"), std::string(79, 'a'));
}

}  // namespace
}  // namespace resonid::monitor

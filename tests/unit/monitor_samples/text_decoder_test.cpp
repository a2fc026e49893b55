// SPDX-License-Identifier: MIT
#include "monitor/samples/text_decoder.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <memory>

#include "monitor/samples/text_values.hpp"

namespace resonid::monitor {
namespace {

constexpr std::int64_t kTime_ns = 1'790'000'000'000'000'000;

/// An arrival with what it points to.
struct Come {
  std::string axis;
  std::optional<std::uint64_t> first;
  std::optional<std::int64_t> time_ns;
  double rate_hz = 0.0;
  std::vector<std::string> columns;
  std::vector<double> values;
  std::vector<std::uint64_t> ends;
};

struct Reader {
  explicit Reader(Format settings) : decoder(std::move(settings), faults) {}
  explicit Reader(SampleFormat format) : Reader(Format{format, {}, {}}) {}

  Batches::Take take() {
    return [this](const Arrival& a) {
      Come come{std::string(a.axis),
                a.first_sample,
                a.time_ns,
                a.sample_rate_hz,
                {},
                {a.values.begin(), a.values.end()},
                {a.ends.begin(), a.ends.end()}};
      for (const auto name : a.columns) come.columns.emplace_back(name);
      all.push_back(come);
    };
  }
  Reader& add(std::string_view text) {
    decoder.add(text, take());
    return *this;
  }
  Reader& message(std::string_view text) {
    decoder.message(text, take());
    return *this;
  }

  FaultLog faults;
  TextDecoder decoder;
  std::vector<Come> all;
};

using Names = std::vector<std::string>;
using Numbers = std::vector<double>;

/// Numbers of LinuxCNC's sampler leave out what found its FIFO full.
TEST(TextDecoder, CountsOverrunsOfASamplerAmongItsSamples) {
  Reader r(Format{SampleFormat::csv, {"sample", "u", "overruns"}, "x", true});
  r.add("7 1.5 0 \n8 2.5 3 \n-1 3.5 3 \n-1 4.5 x \n");
  std::vector<std::uint64_t> first;
  for (const auto& come : r.all) {
    first.push_back(come.first.value());
    EXPECT_EQ(come.columns, Names{"u"});
  }
  EXPECT_EQ(first, (std::vector<std::uint64_t>{7, 11, 2}));
  EXPECT_EQ(r.faults.count(Fault::format), 1U);
  Reader other(Format{SampleFormat::csv, {"sample", "u", "overruns"}, "x", false});
  other.add("8 2.5 3 \n");
  EXPECT_EQ(other.all.at(0).first, 8U);
  EXPECT_EQ(other.all.at(0).columns, (Names{"u", "overruns"}));
}

TEST(TextValues, NumbersAndTimesAsTheyAreWritten) {
  EXPECT_EQ(read_value("+1.5e3"), 1500.0);
  EXPECT_EQ(read_value("1,5", true), 1.5);
  EXPECT_FALSE(read_value("1,5"));
  EXPECT_TRUE(std::isnan(read_value("").value()));
  EXPECT_TRUE(std::isnan(read_value("NaN").value()));
  EXPECT_FALSE(read_value("1.5x"));
  EXPECT_EQ(read_index("18446744073709551615"), UINT64_MAX);
  EXPECT_EQ(read_index("12.0"), 12U);
  EXPECT_FALSE(read_index("-1"));
  EXPECT_FALSE(read_index("1.5"));
  for (const char* text :
       {"1790000000", "1790000000000", "1790000000000000", "1790000000000000000", "1790000000.0",
        "2026-09-21T14:13:20Z", "2026-09-21 15:13:20.000+01:00", "2026-09-21T14:13:20"})
    EXPECT_EQ(read_time(text).time_ns, kTime_ns) << text;
  EXPECT_EQ(read_time("2026-09-21T14:13:20.0005Z").time_ns, kTime_ns + 500'000);
  EXPECT_NEAR(static_cast<double>(*read_time("1790000000.0005").time_ns - kTime_ns), 500'000.0, 200.0);
  EXPECT_TRUE(read_time("0.25").readable);
  EXPECT_FALSE(read_time("0.25").time_ns);
  for (const char* text : {"2026-13-01T00:00:00Z", "1e30", "soon", "2026-09-21T14:13", "9223372036854775807"})
    EXPECT_FALSE(read_time(text).readable) << text;
}

TEST(CsvLines, ComeInPiecesOfAnySize) {
  const std::string text =
      "time,sample,ru,u,y\n1790000000.000,7,1,2,3\n1790000000.001,8,4,5,nan\r\n\n# "
      "9\n1790000000.002,9,7,8,9\n";
  for (std::size_t piece = 1; piece < text.size(); ++piece) {
    Reader reader(SampleFormat::csv);
    for (std::size_t at = 0; at < text.size(); at += piece)
      reader.add(std::string_view(text).substr(at, piece));
    Numbers values;
    std::uint64_t next = 7;
    for (const Come& come : reader.all) {
      EXPECT_EQ(come.first, next);
      EXPECT_EQ(come.columns, (Names{"ru", "u", "y"}));
      next += come.values.size() / 3;
      values.insert(values.end(), come.values.begin(), come.values.end());
    }
    ASSERT_EQ(values.size(), 9U) << piece;
    EXPECT_TRUE(std::isnan(values[5]));
    EXPECT_EQ(values[8], 9.0);
    EXPECT_EQ(reader.all.back().ends.back(), text.size());
    EXPECT_EQ(reader.faults.total(), 0U);
  }
}

TEST(CsvLines, SeparatorsAndDecimalMarksOfTheirWriters) {
  for (const char* text : {"ru;y\n1,5;-2\n", "ru\ty\n1,5\t-2\n", "ru  y\n1.5   -2\n",
                           "\xEF\xBB\xBF\"ru\",\"y\"\n\"1.5\",\"-2\"\n", "ru,y,\n1.5,-2,\n"}) {
    Reader reader(SampleFormat::csv);
    reader.add(text);
    ASSERT_EQ(reader.all.size(), 1U) << text;
    EXPECT_EQ(reader.all[0].columns, (Names{"ru", "y"})) << text;
    EXPECT_EQ(reader.all[0].values, (Numbers{1.5, -2.0})) << text;
  }
}

TEST(CsvLines, SeveralAxesInOneStream) {
  Reader reader(SampleFormat::csv);
  reader.add("axis,sample,y\na,0,1\nb,5,2\na,1,3\nb,6,4\na,9,5\n");
  ASSERT_EQ(reader.all.size(), 3U);
  EXPECT_EQ(reader.all[0].axis, "a");
  EXPECT_EQ(reader.all[0].values, (Numbers{1, 3}));
  EXPECT_EQ(reader.all[0].ends, (std::vector<std::uint64_t>{20, 32}));
  EXPECT_EQ(reader.all[1].first, 9U);
  EXPECT_EQ(reader.all[2].axis, "b");
  EXPECT_EQ(reader.all[2].values, (Numbers{2, 4}));
}

TEST(CsvLines, ConfiguredColumnsNeedNoHeaderAndRenameOne) {
  Reader reader(Format{SampleFormat::csv, {"ru", "y"}, "press"});
  reader.add("1,2\nin,out\n3,4\n");
  ASSERT_EQ(reader.all.size(), 1U);
  EXPECT_EQ(reader.all[0].axis, "press");
  EXPECT_EQ(reader.all[0].columns, (Names{"ru", "y"}));
  EXPECT_EQ(reader.all[0].values, (Numbers{1, 2, 3, 4}));
  EXPECT_EQ(reader.faults.total(), 0U);
}

TEST(CsvLines, ANewHeaderIsTakenAndALineOfWordsIsNot) {
  Reader reader(SampleFormat::csv);
  reader.add("some words\nru,y\n1,2\nthe disk is full\nfull,disk\ny,ru\n3,4\n1,2,3\n");
  ASSERT_EQ(reader.all.size(), 2U);
  EXPECT_EQ(reader.all[0].values, (Numbers{1, 2}));
  EXPECT_EQ(reader.all[1].columns, (Names{"y", "ru"}));
  EXPECT_EQ(reader.faults.count(Fault::format), 3U);
  EXPECT_EQ(reader.faults.example(Fault::format), "3 cells, 2 are required: '1,2,3'");
}

TEST(CsvLines, AColumnMayBeNamedOnceOnly) {
  Reader reader(SampleFormat::csv);
  reader.add("axis,axis,y\na,b,1\n");
  EXPECT_TRUE(reader.all.empty());
  EXPECT_EQ(reader.faults.count(Fault::columns), 2U);  // no names come before the numbers, either
  reader.add("time,timestamp,y\n1790000000.0,5,1\n");  // two columns of time: the first one is it
  ASSERT_EQ(reader.all.size(), 1U);
  EXPECT_EQ(reader.all[0].columns, (Names{"timestamp", "y"}));
  EXPECT_EQ(reader.all[0].values, (Numbers{5, 1}));
}

TEST(CsvLines, GarbageBeforeTheFirstNumbersChangesNothing) {
  const std::string garbage = "\x01;\xfe;\x03\nk\n\xf0\x9f,\x07\n;;\n";
  for (const auto& [columns, header] : {std::pair{Names{"ru", "y"}, ""}, {Names{}, "ru,y\n"}}) {
    Reader reader(Format{SampleFormat::csv, columns, {}});
    reader.add(header + garbage + "1,2\n");
    ASSERT_EQ(reader.all.size(), 1U) << header;
    EXPECT_EQ(reader.all[0].columns, (Names{"ru", "y"}));
    EXPECT_EQ(reader.all[0].values, (Numbers{1, 2}));
    EXPECT_GE(reader.faults.count(Fault::format), 3U);
  }
}

TEST(CsvLines, AJumpOfTimeBeginsAnArrivalOfItsOwn) {
  Reader reader(SampleFormat::csv);
  reader.add("time,y\n1790000000.0,1\n1790000000.05,2\n1790000009.0,3\n1790000008.9,4\n");
  ASSERT_EQ(reader.all.size(), 3U);
  EXPECT_EQ(reader.all[1].time_ns, kTime_ns + 9'000'000'000);
  EXPECT_EQ(reader.all[2].values, Numbers{4});
}

TEST(CsvLines, WhatCannotBeReadIsAFaultWithAnExample) {
  Reader reader(SampleFormat::csv);
  reader.add("1,2\n");
  EXPECT_EQ(reader.faults.count(Fault::columns), 1U);
  reader.add("sample,y\n-1,2\n\x01\xff,3\n");
  EXPECT_EQ(reader.faults.count(Fault::format), 2U);
  EXPECT_EQ(reader.faults.example(Fault::format), "the sample is no index: '??,3'");
  std::string names = "c0", values = "1";
  for (int c = 1; c < 65; ++c) names += ",c" + std::to_string(c), values += ",1";
  reader.add(names + "\n");
  EXPECT_EQ(reader.faults.count(Fault::size), 1U);
}

TEST(TextLines, TooLongOnesAreLeftOutAndTheNextIsRead) {
  Reader reader(SampleFormat::csv);
  reader.add("y\n1\n");
  const std::string piece(100'000, '7');
  for (int k = 0; k < 30; ++k) reader.add(piece);
  reader.add("\n2\n");
  EXPECT_EQ(reader.faults.count(Fault::size), 1U);
  ASSERT_EQ(reader.all.size(), 2U);
  EXPECT_EQ(reader.all[1].values, Numbers{2});
  EXPECT_EQ(reader.all[1].ends[0], 4U + 3'000'000U + 3U);
}

TEST(TextLines, AReaderOfAFileGoesOnWhereItStood) {
  Reader reader(SampleFormat::csv);
  reader.add("ru,y\n");
  reader.decoder.seek(1000);
  reader.add("1,2\n3,");
  reader.add("4\n");
  ASSERT_EQ(reader.all.size(), 2U);
  EXPECT_EQ(reader.all[0].ends, std::vector<std::uint64_t>{1004});
  EXPECT_EQ(reader.all[1].ends, std::vector<std::uint64_t>{1008});
  reader.add("5,6");
  reader.decoder.finish(reader.take());
  EXPECT_EQ(reader.all[2].ends, std::vector<std::uint64_t>{1011});
}

TEST(JsonLines, ObjectsOfNumbersAndOfArrays) {
  Reader reader(SampleFormat::json);
  reader.add(R"({"axis":"x","sample":5,"time":1790000000.5,"rate":2000,"ru":1,"y":2.5}
{"axis":"x","sample":6,"rate":2000,"ru":[3,4],"y":[null,5e-1]}
)");
  ASSERT_EQ(reader.all.size(), 1U);
  const Come& come = reader.all[0];
  EXPECT_EQ(come.axis, "x");
  EXPECT_EQ(come.first, 5U);
  EXPECT_EQ(come.rate_hz, 2000.0);
  EXPECT_EQ(come.time_ns, kTime_ns + 500'000'000);
  ASSERT_EQ(come.values.size(), 6U);
  EXPECT_EQ(come.values[1], 2.5);
  EXPECT_TRUE(std::isnan(come.values[3]));
  EXPECT_EQ(come.values[5], 0.5);
}

TEST(JsonLines, ArraysOfObjectsAndConstantsBesideArrays) {
  Reader reader(SampleFormat::json);
  reader.message(R"([{"axis":"a","y":1},{"axis":"b","y":2},{"axis":"a","y":[3,4],"t":7}])");
  ASSERT_EQ(reader.all.size(), 3U);
  EXPECT_EQ(reader.all[0].values, Numbers{1});
  EXPECT_EQ(reader.all[1].columns, (Names{"t", "y"}));
  EXPECT_EQ(reader.all[1].values, (Numbers{7, 3, 7, 4}));
  EXPECT_EQ(reader.all[2].axis, "b");
}

TEST(JsonLines, EndsOfSamplesOfOneMessageAscendToItsEnd) {
  Reader reader(SampleFormat::json);
  const std::string text = R"([{"sample":0,"y":1},{"sample":1,"y":2},{"sample":9,"y":[3,4]}])";
  reader.message(text);
  ASSERT_EQ(reader.all.size(), 2U);
  EXPECT_EQ(reader.all[0].ends, (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(reader.all[1].ends, (std::vector<std::uint64_t>{3, text.size()}));
}

TEST(JsonLines, MessagesOfSeveralLines) {
  Reader reader(SampleFormat::json);
  reader.message("{\n \"y\": [1,\n 2]\n}\n");
  reader.message("{\"y\":3}\n{\"y\":4}\n");
  ASSERT_EQ(reader.all.size(), 2U);
  EXPECT_EQ(reader.all[0].values, (Numbers{1, 2}));
  EXPECT_EQ(reader.all[1].values, (Numbers{3, 4}));
  EXPECT_EQ(reader.faults.total(), 0U);
}

TEST(JsonLines, NanOfPythonIsReadAndDamageIsAFault) {
  Reader reader(SampleFormat::json);
  reader.add("{\"y\":[1,NaN,-Infinity]}\n");
  ASSERT_EQ(reader.all.size(), 1U);
  EXPECT_TRUE(std::isnan(reader.all[0].values[1]) && std::isnan(reader.all[0].values[2]));
  for (const char* wrong : {"{\"y\":", "7", "{\"axis\":3,\"y\":1}", "{\"sample\":-1,\"y\":1}",
                            "{\"a\":[1],\"b\":[1,2]}", "{\"time\":\"soon\",\"y\":1}", "[[1]]", "NaN"}) {
    const std::uint64_t before = reader.faults.count(Fault::format);
    reader.add(std::string(wrong) + "\n");
    EXPECT_EQ(reader.faults.count(Fault::format), before + 1) << wrong;
  }
  reader.add("{\"axis\":\"x\"}\n");
  EXPECT_EQ(reader.faults.count(Fault::columns), 1U);
  EXPECT_EQ(reader.all.size(), 1U);
  std::string deep(400'000, '[');
  reader.add(deep + "\n");
}

TEST(JsonLines, OneNumberForManySamplesHasALimit) {
  Reader reader(SampleFormat::json);
  std::string text = "{\"y\":[0";
  for (int k = 1; k < 100'000; ++k) text += ",0";
  text += "],\"a\":1,\"b\":2}";
  reader.message(text);
  EXPECT_EQ(reader.faults.count(Fault::size), 1U);
}

TEST(LineProtocol, TagsFieldsAndTime) {
  Reader reader(SampleFormat::line_protocol);
  reader.add(
      "drives,axis=x,site=hall\\ 2 sample=7i,rate=1000,ru=1.5,u=2i,y=-3e-1,on=true,note=\"a, b=c\" "
      "1790000000000000000\n"
      "drives,axis=x sample=8i,rate=1000,ru=1,u=2,y=3\n"
      "press\\,1 y=4\n");
  ASSERT_EQ(reader.all.size(), 2U);
  EXPECT_EQ(reader.all[0].axis, "press,1");
  EXPECT_EQ(reader.all[0].values, Numbers{4});
  EXPECT_EQ(reader.all[1].axis, "x");
  EXPECT_EQ(reader.all[1].first, 7U);
  EXPECT_EQ(reader.all[1].time_ns, kTime_ns);
  EXPECT_EQ(reader.all[1].rate_hz, 1000.0);
  EXPECT_EQ(reader.all[1].columns, (Names{"ru", "u", "y"}));
  EXPECT_EQ(reader.all[1].values, (Numbers{1.5, 2.0, -0.3, 1, 2, 3}));
  for (const char* wrong :
       {"drives", "drives,axis=x", "drives y", "drives y=1,", "drives =1", "m y=1 soon", "m sample=x,y=1"}) {
    const std::uint64_t before = reader.faults.count(Fault::format);
    reader.add(std::string(wrong) + "\n");
    EXPECT_EQ(reader.faults.count(Fault::format), before + 1) << wrong;
  }
  reader.add("m on=true\n");
  EXPECT_EQ(reader.faults.count(Fault::columns), 1U);
  EXPECT_EQ(reader.all.size(), 2U);
}

#ifdef __GLIBC__
/// Names of axes and columns are the sender's.
TEST(TextLines, MemoryStaysSmallWhateverTheSenderCallsItsAxes) {
  FaultLog faults;
  TextDecoder decoder({SampleFormat::json, {}, {}}, faults);
  std::size_t samples = 0;
  const auto take = [&](const Arrival& arrival) { samples += arrival.samples(); };
  std::string numbers = "[0";
  for (int k = 1; k < 10'000; ++k) numbers += ",0";
  const std::string name(100'000, 'n');
  const std::size_t before = ::mallinfo2().uordblks + ::mallinfo2().hblkhd;
  for (int k = 0; k < 50; ++k)
    decoder.add(
        fmt::format("{{\"axis\":\"{0}\",\"y\":{1}]}}\n{{\"axis\":\"{2}{0}\",\"y\":1}}\n", k, numbers, name),
        take);
  EXPECT_LT(::mallinfo2().uordblks + ::mallinfo2().hblkhd, before + 5'000'000);
  EXPECT_EQ(samples, 50U * 10'001U);
  EXPECT_EQ(faults.total(), 0U);
}
#endif

}  // namespace
}  // namespace resonid::monitor

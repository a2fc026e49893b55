// SPDX-License-Identifier: MIT
#include "monitor/sources/stream_source.hpp"

#include <fcntl.h>

#include "installation.hpp"
#include "monitor/sources/descriptor.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;

struct Pipe {
  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    from = Descriptor(ends[0]);
    to = Descriptor(ends[1]);
  }
  void write(std::string_view text) const {
    ASSERT_EQ(::write(to.get(), text.data(), text.size()), static_cast<::ssize_t>(text.size()));
  }
  Descriptor from, to;
};

std::unique_ptr<Source> started(const Pipe& pipe, const Format& format, Axes& axes) {
  auto source = required(make_stream_source({format, pipe.from.get()}, axes));
  source->start();
  return source;
}

TEST(StreamSource, ReadsLinesAlsoInHalvesUntilTheInputIsClosed) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  Pipe pipe;
  const auto source = started(pipe, Format{}, axes);
  const std::string first = "u,y\n" + lines_of(0, 10) + "5.0",
                    second = "00,-10\n" + lines_of(11, 4) + "7.5,-15";
  pipe.write(first);
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  EXPECT_EQ(source->status().state, SourceState::running);
  pipe.write(second);
  pipe.to.close();
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::ended; }));
  axes.expect_exactly("x", 16);
  source->stop();
  source->stop();
  EXPECT_EQ(source->status().bytes, first.size() + second.size());
}

TEST(StreamSource, ReadsEveryFormat) {
  const std::pair<Format, std::string> cases[] = {
      {Format{SampleFormat::json},
       "{\"axis\":\"x\",\"u\":[0,0.5],\"y\":[0,-1]}\n{\"axis\":\"x\",\"u\":1,\"y\":-2}\n"},
      {Format{SampleFormat::line_protocol}, "m,axis=x u=0,y=0\nm,axis=x u=0.5,y=-1\nm,axis=x u=1,y=-2\n"},
      {Format{SampleFormat::csv, {"axis", "u", "y"}}, "x 0 0\nx 0.5 -1\nx 1 -2\n"},
      {Format{SampleFormat::frame}, frame_of("x", 0, 2) + frame_of("x", 2, 1)}};
  for (const auto& [format, text] : cases) {
    const TemporaryFolder folder;
    Installation axes(folder.path(), {"x", "y"});
    Pipe pipe;
    const auto source = started(pipe, format, axes);
    pipe.write(text);
    pipe.to.close();
    ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::ended; }));
    axes.expect_exactly("x", 3);
  }
}

TEST(StreamSource, NamesGarbageAndUnknownAxesAndGoesOn) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x", "y"});
  Pipe pipe;
  const auto source = started(pipe, Format{SampleFormat::csv, {"axis", "u", "y"}}, axes);
  pipe.write("x,0,0\nnobody,1,2\n\x01\x02garbage\nx,1,2,3,4\nx,0.5,-1\n");
  pipe.to.close();
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::ended; }));
  axes.expect_exactly("x", 2);
  const SourceStatus status = source->status();
  EXPECT_EQ(status.unknown, 1U);
  EXPECT_EQ(status.first_unknown,
            std::vector<std::string>{"samples of 'nobody'; a configured axis is required"});
  EXPECT_NE(status.text.find("samples of 'nobody'"), std::string::npos) << status.text;
  EXPECT_NE(status.text.find("5 cells, 3 are required"), std::string::npos) << status.text;
}

TEST(StreamSource, LetsTheWriterWaitWhileTheRingIsFull) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"}, 8192);
  Pipe pipe;
  ASSERT_EQ(::fcntl(pipe.to.get(), F_SETFL, O_NONBLOCK), 0);
  const auto source = started(pipe, Format{SampleFormat::csv, {"u", "y"}}, axes);
  std::uint64_t written = 0;
  // A ring of 8192 takes 5120 samples before less than a second is free.
  while (written < 20'000) {
    const std::string line = line_of(written);
    if (::write(pipe.to.get(), line.data(), line.size()) == static_cast<::ssize_t>(line.size()))
      ++written;
    else if (source->status().state == SourceState::waiting)
      break;
  }
  ASSERT_LT(written, 20'000U);
  EXPECT_NE(source->status().text.find("room"), std::string::npos);
  pipe.to.close();
  std::uint64_t next = 0;
  ASSERT_TRUE(eventually([&] {
    const Piece piece = axes.ring("x").piece(next);
    for (std::size_t k = 0; k < piece.samples; ++k, ++next)
      EXPECT_EQ(piece.values[2 * k + 1], -static_cast<double>(next));
    axes.ring("x").set_read(next);
    return source->status().state == SourceState::ended && next == axes.end("x");
  }));
  EXPECT_EQ(next, written);
  EXPECT_EQ(axes.intake("x").counters().lost, 0U);
}

TEST(StreamSource, TheNextOneGoesOnWithNamesAndHalfALine) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  Pipe pipe;
  std::uint64_t k = 0;
  std::string half = "y,u\n";
  for (const int source_number : {1, 2, 3}) {
    const auto source = started(pipe, Format{}, axes);
    const auto line = [](std::uint64_t n) {
      return std::to_string(-static_cast<double>(n)) + "," + std::to_string(0.5 * static_cast<double>(n));
    };
    pipe.write(half + line(k) + "\n" + line(k + 1).substr(0, 4));
    half = line(k + 1).substr(4) + "\n";
    ASSERT_TRUE(eventually([&] { return axes.end("x") == k + 1; })) << source_number;
    k += 2;
  }
  const auto source = started(pipe, Format{}, axes);
  pipe.write(half);
  pipe.to.close();
  ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::ended; }));
  axes.expect_exactly("x", k);
  EXPECT_EQ(axes.intake("x").faults().total(), 0U);
}

TEST(StreamSource, TheNextOneGoesOnWithinAFrame) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  Pipe pipe;
  const std::string frame = frame_of("x", 10, 10);
  {
    const auto source = started(pipe, Format{SampleFormat::frame}, axes);
    pipe.write(frame_of("x", 0, 10) + frame.substr(0, 70));
    ASSERT_TRUE(eventually([&] { return axes.end("x") == 10; }));
  }
  const auto source = started(pipe, Format{SampleFormat::frame}, axes);
  pipe.write(frame.substr(70));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 20; }));
  axes.expect_exactly("x", 20);
  EXPECT_EQ(axes.intake("x").faults().total() + axes.intake("x").counters().duplicate, 0U);
}

TEST(StreamSource, TheNextOneDeliversWhatWasReadForAFullRing) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"}, 8192);
  Pipe pipe;
  constexpr std::uint64_t kSamples = 8000;
  std::jthread writer([&] {
    std::string_view lines_left;
    const std::string lines = "u,y\n" + lines_of(0, kSamples);
    for (lines_left = lines; !lines_left.empty();
         lines_left.remove_prefix(std::min<std::size_t>(1000, lines_left.size())))
      pipe.write(lines_left.substr(0, 1000));
    pipe.to.close();
  });
  for (int k = 0; k < 2; ++k) {  // the second one delivers nothing either
    const auto source = started(pipe, Format{}, axes);
    ASSERT_TRUE(eventually([&] { return source->status().state == SourceState::waiting; }));
  }
  EXPECT_LT(axes.end("x"), kSamples);
  const auto source = started(pipe, Format{}, axes);
  std::uint64_t next = 0;
  ASSERT_TRUE(eventually([&] {
    const Piece piece = axes.ring("x").piece(next);
    for (std::size_t k = 0; k < piece.samples; ++k, ++next)
      EXPECT_EQ(piece.values[2 * k + 1], -static_cast<double>(next));
    axes.ring("x").set_read(next);
    return source->status().state == SourceState::ended && next == axes.end("x");
  }));
  EXPECT_EQ(next, kSamples);
}

TEST(StreamSource, StopsAtOnceWhileItWaits) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"}, 8192);
  Pipe pipe;
  const auto source = started(pipe, Format{SampleFormat::csv, {"u", "y"}}, axes);
  const auto begin = std::chrono::steady_clock::now();
  source->stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
}

TEST(StreamSource, RefusesADescriptorThatIsNone) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {});
  RESONID_EXPECT_MESSAGE(make_stream_source({Format{}, -1}, axes), "descriptor");
}

}  // namespace
}  // namespace resonid::monitor

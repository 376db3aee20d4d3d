#include "hal/tracker.h"

#include <catch2/catch.hpp>
#include <limits>

using namespace tendril::hal;

TEST_CASE("A sighting has the bytes of the tracker's frame", "[unit]") {
  const auto frame = encode_tracker(0x1F0, {{0.01, -0.01, 0.125}, 2'500'000});
  REQUIRE(frame);
  CHECK(to_text(*frame) == "1F0#E80318FCD430FA00");  // 1000, -1000, 12500 in 10 µm; 250 in 10 µs
  const auto sample = decode_tracker(*frame);
  REQUIRE(sample);
  CHECK(sample->position[0] == Approx(0.01));
  CHECK(sample->position[1] == Approx(-0.01));
  CHECK(sample->position[2] == Approx(0.125));
  CHECK(sample->age_ns == 2'500'000);
}

TEST_CASE("A position that does not fit the frame is not sent, an old one is sent as old", "[unit]") {
  CHECK_FALSE(encode_tracker(0x1F0, {{0.33, 0, 0}, 0}));
  CHECK_FALSE(encode_tracker(0x1F0, {{0, std::numeric_limits<double>::quiet_NaN(), 0}, 0}));
  CHECK(encode_tracker(0x1F0, {{-0.32767, 0.32767, 0}, 0}));
  CHECK(decode_tracker(*encode_tracker(0x1F0, {{0, 0, 0}, 10'000'000'000}))->age_ns == 655'350'000);
  CHECK_FALSE(decode_tracker(*parse_frame("1F0#00000000000000")));
}

#include "io/performance_page.h"

#include <gtest/gtest.h>

#include "io/write_file.h"
#include "tests/io/temporary_directory.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::io::performance_page_test {
namespace {

TEST(PerformancePage, ShowsEveryRunThatThereIs) {
  const retarget::Performer performer = retarget::make_box_performer();
  const retarget::SignalSet signals = retarget::signals_of(performer);
  retarget::PerformOptions options;
  options.replay.duration_s = 0.2;
  const TemporaryDirectory directory;
  const auto page = [&] {
    write_performance_page(directory.path / "page.html", performer, {}, signals, retarget::perform(performer, signals, options), {});
    return read_file(directory.path / "page.html");
  };
  const std::string all = page();
  for (const char* role : {"clip", "target", "replay", "open_loop", "naive"}) {
    EXPECT_NE(all.find("\"role\":\"" + std::string(role) + "\",\"of_skin\""), std::string::npos) << role;
  }
  for (const char* text : {"Way of the centre of mass", "Size of the correction", "\"name\":\"back_left\"", "\"patch\":\"front_right\""}) {
    EXPECT_NE(all.find(text), std::string::npos) << text;
  }
  options.closed_loop = false;
  EXPECT_EQ(page().find("Size of the correction"), std::string::npos);
}

}  // namespace
}  // namespace hydrostat::io::performance_page_test

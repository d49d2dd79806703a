// How long the dense maps and the robot's eye take, beside OpenCV in the same run, on one thread.
//
//   bench_stereo          a table
//   bench_stereo --json   one JSON object a case
//
// Not a test: times depend on the machine and on what else runs. Ours and OpenCV's turns alternate,
// so that both suffer alike; the minimum is the figure to compare.
#include "pictures.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

extern "C" {
#include "vision/color.h"
#include "vision/dense_bm.h"
#include "vision/robot_eye.h"
}

namespace
{

constexpr int kTurns = 101;

struct Times {
    double min_ms = 0;
    double median_ms = 0;
};

double time_ms(const std::function<void()> &work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

Times summary(std::vector<double> times)
{
    std::sort(times.begin(), times.end());
    return {times.front(), times[times.size() / 2]};
}

class Output
{
  public:
    explicit Output(bool json) : json_(json)
    {
        if (!json_)
            std::printf("%-36s %17s %17s %7s\n", "case, ms", "ours min median", "OpenCV", "ratio");
    }

    void with_peer(const char *name, const std::function<void()> &ours,
                   const std::function<void()> &theirs) const
    {
        std::vector<double> our_times;
        std::vector<double> their_times;
        for (int turn = 0; turn < kTurns; turn++) {
            our_times.push_back(time_ms(ours));
            their_times.push_back(time_ms(theirs));
        }
        const Times our = summary(our_times);
        const Times their = summary(their_times);
        std::printf(json_ ? "{\"case\":\"%s\",\"ours_min_ms\":%.3f,\"ours_median_ms\":%.3f,"
                            "\"opencv_min_ms\":%.3f,\"opencv_median_ms\":%.3f,\"ratio\":%.2f}\n"
                          : "%-36s %8.3f %8.3f %8.3f %8.3f %7.2f\n",
                    name, our.min_ms, our.median_ms, their.min_ms, their.median_ms,
                    their.min_ms / our.min_ms);
    }

    void alone(const char *name, const std::function<void()> &ours) const
    {
        std::vector<double> times;
        for (int turn = 0; turn < kTurns; turn++)
            times.push_back(time_ms(ours));
        const Times our = summary(times);
        std::printf(json_ ? "{\"case\":\"%s\",\"ours_min_ms\":%.3f,\"ours_median_ms\":%.3f}\n"
                          : "%-36s %8.3f %8.3f\n",
                    name, our.min_ms, our.median_ms);
    }

  private:
    bool json_;
};

void bench_bm(const Output &output, cv::Size size, uint16_t disparities)
{
    const Pair pair = aloe(size);
    const dense_eye_t left = eye_of(pair.left);
    const dense_eye_t right = eye_of(pair.right);
    const bm_params_t params = bm_defaults(9, disparities);
    std::vector<uint32_t> work(bm_work_words(left.width, left.height, &params));
    cv::Mat ours(size, CV_16S);
    cv::Mat theirs;
    cv::Ptr<cv::StereoBM> matcher = cv::StereoBM::create(disparities, 9);
    char name[64];
    std::snprintf(name, sizeof name, "bm %dx%d, %d disparities, block 9", size.width, size.height,
                  disparities);
    output.with_peer(
        name,
        [&] {
            bm_map(&left, &right, &params, work.data(), static_cast<uint32_t>(work.size()),
                   ours.ptr<int16_t>(), static_cast<uint16_t>(size.width));
        },
        [&] { matcher->compute(pair.left, pair.right, theirs); });
}

void bench_sad(const Output &output, cv::Size size, uint16_t disparities)
{
    const Pair pair = aloe(size);
    const dense_eye_t left = eye_of(pair.left);
    const dense_eye_t right = eye_of(pair.right);
    dense_params_t params = {MATCH_SAD, 1, 0, 8, disparities, 0};
    std::vector<uint32_t> work(dense_work_words(left.width, &params));
    cv::Mat ours(size, CV_16S);
    char name[64];
    std::snprintf(name, sizeof name, "sad %dx%d, %d disparities, block 8", size.width, size.height,
                  disparities);
    output.alone(name, [&] {
        dense_map(&left, &right, &params, work.data(), static_cast<uint32_t>(work.size()),
                  ours.ptr<int16_t>(), static_cast<uint16_t>(size.width));
    });
}

std::vector<uint16_t> rgb565(const cv::Mat &bgr)
{
    std::vector<uint16_t> pixels;
    for (int y = 0; y < bgr.rows; y++)
        for (int x = 0; x < bgr.cols; x++) {
            const auto &c = bgr.at<cv::Vec3b>(y, x);
            pixels.push_back(
                static_cast<uint16_t>((c[2] >> 3) << 11 | (c[1] >> 2) << 5 | (c[0] >> 3)));
        }
    return pixels;
}

void bench_eye(const Output &output)
{
    const std::string folder = STEREOSOT_SCENES;
    const auto left = rgb565(read_picture(folder + "/paper_left.png", cv::IMREAD_COLOR));
    const auto right = rgb565(read_picture(folder + "/paper_right.png", cv::IMREAD_COLOR));
    const eye_params_t params = eye_params_default;
    const frame_pair_t frames = {{left.data(), right.data()}};
    static robot_eye_t eye;
    report_t report;
    output.alone("robot's eye, one pair of frames", [&] {
        robot_eye_begin(&eye, &params);
        for (int row = 0; row < CAMERA_HEIGHT_PX; row++)
            robot_eye_row(&eye, static_cast<uint8_t>(row), &left[row * CAMERA_WIDTH_PX],
                          &right[row * CAMERA_WIDTH_PX]);
        robot_eye_end(&eye, &frames, &report);
    });
}

} // namespace

int main(int argc, char **argv)
{
    const bool json = argc == 2 && std::strcmp(argv[1], "--json") == 0;
    if (argc > 1 && !json) {
        std::fprintf(stderr, "usage: bench_stereo [--json]\n");
        return 2;
    }
    cv::setNumThreads(1);
    const Output output(json);
    bench_bm(output, {320, 240}, 64);
    bench_bm(output, {320, 240}, 80);
    bench_bm(output, {640, 480}, 128);
    bench_sad(output, {320, 240}, 64);
    bench_sad(output, {320, 240}, 80);
    bench_eye(output);
    return 0;
}

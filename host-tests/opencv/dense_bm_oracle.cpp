// bm_map against cv::StereoBM, pixel for pixel, over a grid of parameters on photographs, rendered
// scenes, noise, constant pictures and small and odd sizes. Exits 1 and prints the first
// differences.
#include "pictures.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

extern "C" {
#include "vision/dense_bm.h"
}

namespace
{

cv::Mat opencv_map(const Pair &pair, const bm_params_t &params)
{
    cv::Ptr<cv::StereoBM> matcher = cv::StereoBM::create(params.disparities, params.block);
    // Where there is no room for a single block OpenCV leaves what was there.
    cv::Mat map(pair.left.size(), CV_16S, cv::Scalar(DENSE_INVALID_Q4));
    matcher->setPreFilterType(cv::StereoBM::PREFILTER_XSOBEL);
    matcher->setPreFilterCap(params.prefilter_cap);
    matcher->setUniquenessRatio(params.uniqueness_percent);
    matcher->setTextureThreshold(params.texture_min);
    matcher->setDisp12MaxDiff(params.left_right_max);
    matcher->compute(pair.left, pair.right, map);
    return map;
}

cv::Mat our_map(const Pair &pair, const bm_params_t &params)
{
    const dense_eye_t left = eye_of(pair.left);
    const dense_eye_t right = eye_of(pair.right);
    std::vector<uint32_t> work(bm_work_words(left.width, left.height, &params));
    cv::Mat map(pair.left.size(), CV_16S);
    const dense_error_t error =
        bm_map(&left, &right, &params, work.data(), static_cast<uint32_t>(work.size()),
               map.ptr<int16_t>(), static_cast<uint16_t>(map.step1()));
    if (error != DENSE_OK) {
        std::printf("%s: bm_map says %d\n", pair.name.c_str(), error);
        map.setTo(0);
    }
    return map;
}

void print_first(const cv::Mat &ours, const cv::Mat &theirs)
{
    for (int y = 0; y < ours.rows; y++)
        for (int x = 0; x < ours.cols; x++)
            if (ours.at<int16_t>(y, x) != theirs.at<int16_t>(y, x)) {
                std::printf("  first at (%d,%d): %d, OpenCV %d\n", x, y, ours.at<int16_t>(y, x),
                            theirs.at<int16_t>(y, x));
                return;
            }
}

struct Tally {
    long maps = 0;
    long pixels = 0;
    long valid = 0;
    long different = 0;
};

void compare(const Pair &pair, const bm_params_t &params, Tally &tally)
{
    const cv::Mat ours = our_map(pair, params);
    const cv::Mat theirs = opencv_map(pair, params);
    const int different = cv::countNonZero(ours != theirs);
    tally.maps++;
    tally.pixels += static_cast<long>(ours.total());
    tally.valid += cv::countNonZero(theirs >= 0);
    if (different && tally.different < 100000) {
        std::printf("%s block %d disparities %d cap %d uniqueness %d texture %d left-right %d: "
                    "%d pixels differ\n",
                    pair.name.c_str(), params.block, params.disparities, params.prefilter_cap,
                    params.uniqueness_percent, params.texture_min, params.left_right_max,
                    different);
        print_first(ours, theirs);
    }
    tally.different += different;
}

void compare_grid(const Pair &pair, Tally &tally)
{
    for (int block = 5; block <= 21; block += 2) {
        if (block >= std::min(pair.left.cols, pair.left.rows))
            continue; // OpenCV refuses
        for (int disparities : {16, 32, 64, 80, 128}) {
            bm_params_t params =
                bm_defaults(static_cast<uint8_t>(block), static_cast<uint16_t>(disparities));
            compare(pair, params, tally);
            params.left_right_max = 1;
            compare(pair, params, tally);
        }
    }
}

void compare_thresholds(const Pair &pair, Tally &tally)
{
    for (int block : {5, 9, 17, 21})
        for (int cap : {1, 2, 31, 32, 63})
            for (int uniqueness : {0, 1, 15, 50, 100})
                for (int texture : {0, 10, 507, 5000})
                    for (int left_right : {-1, 0, 2}) {
                        if (cap > 31 && left_right >= 0)
                            continue; // a defect of OpenCV: see dense_bm.h
                        bm_params_t params = bm_defaults(static_cast<uint8_t>(block), 48);
                        params.prefilter_cap = static_cast<uint8_t>(cap);
                        params.uniqueness_percent = static_cast<uint8_t>(uniqueness);
                        params.texture_min = static_cast<uint16_t>(texture);
                        params.left_right_max = static_cast<int16_t>(left_right);
                        compare(pair, params, tally);
                    }
}

void report(const char *what, const Tally &tally, long &different)
{
    std::printf("%s: %ld maps, %ld pixels, %ld with a disparity, %ld different\n", what, tally.maps,
                tally.pixels, tally.valid, tally.different);
    different += tally.different;
}

} // namespace

int main()
{
    cv::RNG random(22); // any seed; fixed so that a failure can be repeated
    long different = 0;
    Tally photographs;
    Tally rendered;
    Tally small;
    Tally thresholds;

    compare_grid(aloe({320, 240}), photographs);
    compare_grid(aloe({427, 277}), photographs);
    report("photographs", photographs, different);
    for (const Pair &pair : scenes()) {
        compare(pair, bm_defaults(9, 64), rendered);
        compare(pair, bm_defaults(9, 80), rendered);
        compare(pair, bm_defaults(15, 128), rendered);
    }
    report("scenes", rendered, different);
    for (int trial = 0; trial < 60; trial++)
        compare_grid(noise(random, {random.uniform(6, 180), random.uniform(6, 60)}), small);
    compare_grid(constant({100, 40}, 0, 255), small);
    compare_grid(constant({100, 40}, 128, 128), small);
    report("noise, constants, odd and small sizes", small, different);
    compare_thresholds(aloe({161, 101}), thresholds);
    compare_thresholds(noise(random, {130, 40}), thresholds);
    report("thresholds", thresholds, different);
    return different != 0;
}

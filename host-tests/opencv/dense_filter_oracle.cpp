// The speckle filter against cv::filterSpeckles, the median against cv::medianBlur, and the
// left-right check against cv::validateDisparity, on maps of photographs and on noise. Exits 1 if a
// pixel differs.
#include "pictures.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

extern "C" {
#include "vision/dense_filter.h"
}

namespace
{

// Disparities in patches, some of them missing: noise, blurred and cut into steps.
cv::Mat patches(cv::RNG &random, cv::Size size)
{
    cv::Mat noise(size, CV_8U);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::blur(noise, noise, cv::Size(3, 3));
    cv::Mat map(size, CV_16S);
    for (int y = 0; y < size.height; y++)
        for (int x = 0; x < size.width; x++) {
            const int value = noise.at<uint8_t>(y, x) / 16 * 16 - 80;
            map.at<int16_t>(y, x) =
                static_cast<int16_t>(value < 0 || value > 16 * x ? DENSE_INVALID_Q4 : value);
        }
    return map;
}

uint16_t side(int length)
{
    return static_cast<uint16_t>(length);
}

int check_speckles(const cv::Mat &map, int max_pixels, int max_difference)
{
    cv::Mat ours = map.clone();
    cv::Mat theirs = map.clone();
    std::vector<uint32_t> work(DENSE_SPECKLE_WORDS(map.cols, map.rows));
    dense_speckles(ours.ptr<int16_t>(), side(map.cols), side(map.rows), side(map.cols),
                   static_cast<uint32_t>(max_pixels), static_cast<uint16_t>(max_difference),
                   work.data());
    cv::filterSpeckles(theirs, DENSE_INVALID_Q4, max_pixels, max_difference);
    return cv::countNonZero(ours != theirs);
}

int check_median(const cv::Mat &map)
{
    cv::Mat ours(map.size(), CV_16S);
    cv::Mat theirs;
    dense_median(map.ptr<int16_t>(), side(map.cols), side(map.rows), side(map.cols),
                 ours.ptr<int16_t>(), side(map.cols));
    cv::medianBlur(map, theirs, 3);
    return cv::countNonZero(ours != theirs);
}

int check_left_right(cv::RNG &random, const cv::Mat &map, int max_px)
{
    constexpr int kDisparities = 16; // of validateDisparity: where it starts
    cv::Mat costs(map.size(), CV_16S);
    random.fill(costs, cv::RNG::UNIFORM, 0, 50); // few values, so that some are equal
    cv::Mat ours = map.clone();
    cv::Mat theirs = map.clone();
    std::vector<uint32_t> work(DENSE_LEFT_RIGHT_WORDS(map.cols));
    for (int y = 0; y < map.rows; y++)
        dense_left_right_row(ours.ptr<int16_t>(y), costs.ptr<uint16_t>(y), side(map.cols),
                             kDisparities, static_cast<uint16_t>(max_px), work.data());
    cv::validateDisparity(theirs, costs, 0, kDisparities, max_px);
    return cv::countNonZero(ours != theirs);
}

} // namespace

int main()
{
    cv::RNG random(23); // any seed; fixed so that a failure can be repeated
    int speckles = 0;
    int median = 0;
    int left_right = 0;
    for (int trial = 0; trial < 200; trial++) {
        const cv::Mat map = patches(random, {random.uniform(20, 150), random.uniform(1, 90)});
        speckles += check_speckles(map, random.uniform(0, 60), random.uniform(0, 40));
        median += check_median(map);
        left_right += check_left_right(random, map, random.uniform(0, 4));
    }
    std::printf("200 maps, pixels that differ from OpenCV: %d speckles, %d median, "
                "%d left-right\n",
                speckles, median, left_right);
    return speckles + median + left_right != 0;
}

# The suite on ROS 2 Jazzy: diagnosis, simulator and page.
#   docker build -t tomr . && docker run --rm --network host tomr
#   docker run --rm --network host -v $PWD/my.yaml:/my.yaml tomr \
#       ros2 launch tomr_fault_diag diagnosis.launch.py robot:=/my.yaml composition:=true
FROM ros:jazzy-ros-base
RUN apt-get update && apt-get install -y --no-install-recommends \
        python3-attr python3-jinja2 python3-lz4 python3-matplotlib python3-numpy python3-pip \
        python3-rich python3-scipy python3-tqdm python3-yaml ros-jazzy-tf2-msgs \
    && rm -rf /var/lib/apt/lists/*
# What has no package of its own; numpy stays that of ROS, which its messages are built against.
RUN pip install --break-system-packages --no-cache-dir \
        rosbags==0.11.9 mujoco==4.0.0 websockets==17.4 "numpy<2"
WORKDIR /opt/tomr
COPY src src
RUN . /opt/ros/jazzy/setup.sh && colcon build --base-paths src
ENTRYPOINT ["/ros_entrypoint.sh", "bash", "-c", ". /opt/tomr/install/setup.bash && exec \"$@\"", "--"]
CMD ["ros2", "launch", "tomr_demo", "simulation.launch.py", "composition:=true"]

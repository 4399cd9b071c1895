using System;
using System.Runtime.InteropServices;
using UnityEngine.XR.OpenXR;
using UnityEngine.XR.OpenXR.Features;

namespace HapticVLM
{
    /// <summary>
    /// Submits samples to the controllers through the OpenXR extension XR_FB_haptic_pcm, which Quest's runtime has. Enable it
    /// under Project Settings > XR Plug-in Management > OpenXR. It follows the extension's text (Khronos registry) and has
    /// been tested against a stand-in runtime only; nobody has held it.
    /// </summary>
#if UNITY_EDITOR
    [UnityEditor.XR.OpenXR.Features.OpenXRFeature(
        UiName = "HapticVLM: samples on controllers",
        Desc = "Controllers play what a palm speaker would, where the runtime supports " + Extension + ".",
        Company = "HapticVLM",
        Version = "1",
        FeatureId = "com.hapticvlm.pcm",
        OpenxrExtensionStrings = Extension,
        BuildTargetGroups = new[] { UnityEditor.BuildTargetGroup.Android, UnityEditor.BuildTargetGroup.Standalone })]
#endif
    public sealed class HapticPcmFeature : OpenXRFeature
    {
        /// <summary>XR_MAX_HAPTIC_PCM_BUFFER_SIZE_FB: the runtime stores no more samples.</summary>
        public const int Most = 4000;

        const float MostHz = 48000f;
        const string Extension = "XR_FB_haptic_pcm";
        const int ActionInfoType = 59, VibrationType = 1000209001, RateType = 1000209002; // XrStructureType

        struct ActionInfo
        {
            public int Type;
            public IntPtr Next;
            public ulong Action, Path;
        }

        struct PcmVibration
        {
            public int Type;
            public IntPtr Next;
            public uint Size;
            public IntPtr Samples;
            public float RateHz;
            public uint Append; // XrBool32
            public IntPtr Consumed;
        }

        struct PcmRate
        {
            public int Type;
            public IntPtr Next;
            public float RateHz;
        }

        delegate int GetFunction(ulong instance, [MarshalAs(UnmanagedType.LPStr)] string name, out IntPtr function);

        delegate int ApplyFeedback(ulong session, ref ActionInfo info, ref PcmVibration vibration);

        delegate int StopFeedback(ulong session, ref ActionInfo info);

        delegate int GetRate(ulong session, ref ActionInfo info, ref PcmRate rate);

        ApplyFeedback apply;
        StopFeedback stop;
        GetRate rateOf;
        IntPtr block; // the samples, and then how many the runtime took
        ulong session, left, right;

        /// <summary>Samples per second that the device bound to this action takes, Hz; 0: none.</summary>
        public int RateHz(ulong action, HandSide hand)
        {
            if (session == 0 || action == 0) return 0;
            ActionInfo info = Info(action, hand);
            var rate = new PcmRate { Type = RateType };
            bool isKnown = rateOf(session, ref info, ref rate) >= 0 && rate.RateHz >= 1f && rate.RateHz <= MostHz;
            return isKnown ? (int)rate.RateHz : 0;
        }

        /// <summary>Plays the first `count` samples; returns how many the runtime took.</summary>
        public int Play(ulong action, HandSide hand, float[] wave, int count, int rateHz, bool replaces)
        {
            if (session == 0 || action == 0) return 0;
            count = Math.Min(count, Most);
            IntPtr consumed = block + Most * sizeof(float);
            Marshal.Copy(wave, 0, block, count);
            Marshal.WriteInt32(consumed, 0);
            ActionInfo info = Info(action, hand);
            var vibration = new PcmVibration { Type = VibrationType, Size = (uint)count, Samples = block, RateHz = rateHz, Append = replaces ? 0u : 1u, Consumed = consumed };
            return apply(session, ref info, ref vibration) >= 0 ? Marshal.ReadInt32(consumed) : 0;
        }

        public void Stop(ulong action, HandSide hand)
        {
            if (session == 0 || action == 0) return;
            ActionInfo info = Info(action, hand);
            stop(session, ref info);
        }

        protected override bool OnInstanceCreate(ulong xrInstance)
        {
            if (!OpenXRRuntime.IsExtensionEnabled(Extension)) return false;
            var find = Marshal.GetDelegateForFunctionPointer<GetFunction>(xrGetInstanceProcAddr);
            apply = Function<ApplyFeedback>(find, xrInstance, "xrApplyHapticFeedback");
            stop = Function<StopFeedback>(find, xrInstance, "xrStopHapticFeedback");
            rateOf = Function<GetRate>(find, xrInstance, "xrGetDeviceSampleRateFB");
            left = StringToPath("/user/hand/left");
            right = StringToPath("/user/hand/right");
            bool isWhole = apply != null && stop != null && rateOf != null && left != 0 && right != 0;
            if (isWhole) block = Marshal.AllocHGlobal((Most + 1) * sizeof(float));
            return isWhole;
        }

        protected override void OnInstanceDestroy(ulong xrInstance)
        {
            session = 0;
            Marshal.FreeHGlobal(block);
            block = IntPtr.Zero;
        }

        protected override void OnSessionCreate(ulong xrSession)
        {
            session = block == IntPtr.Zero ? 0 : xrSession;
        }

        protected override void OnSessionDestroy(ulong xrSession)
        {
            session = 0;
        }

        ActionInfo Info(ulong action, HandSide hand)
        {
            return new ActionInfo { Type = ActionInfoType, Action = action, Path = hand == HandSide.Left ? left : right };
        }

        static T Function<T>(GetFunction find, ulong instance, string name) where T : class
        {
            IntPtr function;
            bool isThere = find(instance, name, out function) >= 0 && function != IntPtr.Zero;
            return isThere ? Marshal.GetDelegateForFunctionPointer<T>(function) : null;
        }
    }
}

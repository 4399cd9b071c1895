using System;
using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// All unsent messages, in order of priority: stop, ownership, settings, scene, touch, frame, texture map. The
    /// scene goes before touches, so that no touch names an object that the service does not know.
    /// </summary>
    public sealed class Outbox
    {
        const int SurfacesSinceMinor = 2; // of the protocol; an older service refuses a message with an unknown field

        public readonly SceneRegistry Scene = new SceneRegistry();
        public readonly TouchRing Touches = new TouchRing();
        public readonly FrameMailbox Frames = new FrameMailbox();

        /// <summary>Holds the texture map that was not sent yet; a live frame neither replaces it nor waits for its answer.</summary>
        public readonly FrameMailbox Maps = new FrameMailbox();
        public readonly Requests Requests = new Requests();
        public readonly RequestIds Ids = new RequestIds();

        public readonly OutputOwnership Ownership;

        readonly AutoResetEvent wakeup = new AutoResetEvent(false);
        readonly MsgPackWriter writer = new MsgPackWriter(4096);
        readonly object gate = new object();
        Set settings;
        bool settingsChanged;
        Feel feel;
        bool feelChanged;
        Scope stop;
        volatile bool knowsSurfaces;

        public Outbox(bool wantsOutputs = true)
        {
            Ownership = new OutputOwnership(wantsOutputs);
        }

        /// <summary>Queues a stop. Different scopes that are not sent yet combine to All.</summary>
        public void Stop(Scope scope)
        {
            lock (gate) stop = stop == Scope.Other || stop == scope ? scope : Scope.All;
            Wake();
        }

        /// <summary>Sets the gains, 0..1; they are sent again whenever this scene gains the outputs.</summary>
        public void SetGains(double vibration, double thermal)
        {
            lock (gate)
            {
                settings.VibrationGain = vibration;
                settings.ThermalGain = thermal;
                settingsChanged = true;
            }
            Wake();
        }

        /// <summary>
        /// Requests the vibration of each hand in this form; null for none. It is sent as a message of its
        /// own, since an older service refuses it, and again whenever this scene gains the outputs.
        /// </summary>
        public void SetFeel(FeelForm? left, FeelForm? right)
        {
            lock (gate)
            {
                if (feel.Left == left && feel.Right == right) return;
                feel = new Feel { Left = left, Right = right };
                feelChanged = true;
            }
            Wake();
        }

        /// <summary>Whether the service of this session takes surfaces and texture maps.</summary>
        public bool KnowsSurfaces { get { return knowsSurfaces; } }

        /// <summary>Makes Wait return.</summary>
        public void Wake()
        {
            wakeup.Set();
        }

        /// <summary>Waits for Wake, at most this many milliseconds.</summary>
        public void Wait(int milliseconds)
        {
            wakeup.WaitOne(milliseconds);
        }

        /// <summary>
        /// Resets the outbox after a welcome and drops old touches and frames. Ownership is not reset here:
        /// the receiving thread did so when the welcome arrived, before any later message of the service.
        /// </summary>
        public void Restart(Welcome welcome)
        {
            Touches.Clear();
            Frames.Clear();
            Maps.Clear();
            Requests.Restart();
            knowsSurfaces = welcome.Protocol.Minor >= SurfacesSinceMinor;
            Scene.Restart(welcome.Materials, knowsSurfaces);
            QueueSettings();
        }

        /// <summary>Records that the service granted the request to take or release the outputs.</summary>
        internal void OwnershipGranted()
        {
            Ownership.Granted();
            QueueSettings();
            Wake();
        }

        void QueueSettings()
        {
            lock (gate)
            {
                settingsChanged = settings.VibrationGain != null;
                feelChanged = feel.Left != null || feel.Right != null;
            }
        }

        /// <summary>Encodes and returns the next message, or null. It stays valid until the next call.</summary>
        public MsgPackWriter Next(double now)
        {
            writer.Reset();
            if (WriteStop() || WriteOwnership() || WriteSettings() || WriteFeel() || Scene.Write(writer, Ids) || WriteTouch()) return writer;
            return (Requests.MaySendFrame(now) ? TakeFrame(now) : null) ?? Maps.Take();
        }

        bool WriteStop()
        {
            lock (gate)
            {
                if (stop == Scope.Other) return false;
                var message = new Stop { Id = Ids.Next(), Scope = stop };
                stop = Scope.Other;
                message.Write(writer);
                return true;
            }
        }

        bool WriteOwnership()
        {
            SetOwnership request = Ownership.Next();
            if (request == SetOwnership.Other) return false;
            var message = new Set { Id = Ids.Next(), Ownership = request };
            message.Write(writer);
            Requests.Sent(message.Id, Kind.Set, Clock.Now);
            return true;
        }

        bool WriteSettings()
        {
            lock (gate)
            {
                if (!settingsChanged || !Ownership.IsOwner) return false;
                settingsChanged = false;
                settings.Id = Ids.Next();
                settings.Write(writer);
                return true;
            }
        }

        bool WriteFeel()
        {
            lock (gate)
            {
                if (!feelChanged || !Ownership.IsOwner) return false;
                feelChanged = false;
                new Set { Id = Ids.Next(), Feel = feel }.Write(writer);
                return true;
            }
        }

        bool WriteTouch()
        {
            Touch touch;
            if (!Touches.Take(out touch)) return false;
            touch.Id = Ids.Next();
            if (!knowsSurfaces) touch.Surface = null;
            touch.Write(writer);
            Requests.Sent(touch.Id, Kind.Touch, touch.CapturedAt);
            return true;
        }

        MsgPackWriter TakeFrame(double now)
        {
            MsgPackWriter frame = Frames.Take();
            if (frame == null) return null;
            long id;
            Protocol.KindOf(frame.Written, out id);
            Requests.Sent(id, Kind.Frame, now);
            return frame;
        }
    }
}

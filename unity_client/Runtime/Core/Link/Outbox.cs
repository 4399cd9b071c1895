using System;
using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Everything that waits to be sent, in order of urgency: stop, ownership, settings, scene, touch, frame.
    /// The scene goes before touches, so that no touch meets an object the service does not know.
    /// </summary>
    public sealed class Outbox
    {
        public readonly SceneBook Scene = new SceneBook();
        public readonly TouchRing Touches = new TouchRing();
        public readonly FrameMailbox Frames = new FrameMailbox();
        public readonly Requests Requests = new Requests();
        public readonly RequestIds Ids = new RequestIds();

        public readonly OutputOwnership Ownership;

        readonly AutoResetEvent somethingNew = new AutoResetEvent(false);
        readonly MsgPackWriter writer = new MsgPackWriter(4096);
        readonly object gate = new object();
        Set settings;
        bool settingsChanged;
        Feel feel;
        bool feelChanged;
        Scope stop;

        public Outbox(bool wantsOutputs = true)
        {
            Ownership = new OutputOwnership(wantsOutputs);
        }

        /// <summary>Asks for rest; of several scopes not sent yet all are meant.</summary>
        public void Stop(Scope scope)
        {
            lock (gate) stop = stop == Scope.Other || stop == scope ? scope : Scope.All;
            Wake();
        }

        /// <summary>Gains, 0..1; they are told again whenever the outputs become this scene's.</summary>
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
        /// Which hands' vibration to send, and in which form; null for none. A message of its own, since
        /// a service of before refuses it. It goes out again whenever the outputs become this scene's.
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

        /// <summary>Has Wait return.</summary>
        public void Wake()
        {
            somethingNew.Set();
        }

        /// <summary>Waits until Wake was called, or so many milliseconds.</summary>
        public void Wait(int milliseconds)
        {
            somethingNew.WaitOne(milliseconds);
        }

        /// <summary>
        /// Starts over after a welcome: touches and frames of before are of no use. Whose the outputs are
        /// was taken over when the welcome came, before what the service says after it.
        /// </summary>
        public void Restart(Welcome welcome)
        {
            Touches.Clear();
            Frames.Clear();
            Requests.Restart();
            Scene.Restart(welcome.Materials);
            TellSettingsAgain();
        }

        /// <summary>The service did as was asked: the outputs are this scene's, or given up.</summary>
        internal void OwnershipGranted()
        {
            Ownership.Granted();
            TellSettingsAgain();
            Wake();
        }

        void TellSettingsAgain()
        {
            lock (gate)
            {
                settingsChanged = settings.VibrationGain != null;
                feelChanged = feel.Left != null || feel.Right != null;
            }
        }

        /// <summary>The next message, or null; valid until the next call. For the sending thread.</summary>
        public MsgPackWriter Next(double now)
        {
            writer.Reset();
            if (WriteStop() || WriteOwnership() || WriteSettings() || WriteFeel() || Scene.Write(writer, Ids) || WriteTouch()) return writer;
            return Requests.MaySendFrame(now) ? TakeFrame(now) : null;
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
            SetOwnership wanted = Ownership.Next();
            if (wanted == SetOwnership.Other) return false;
            var message = new Set { Id = Ids.Next(), Ownership = wanted };
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

using System.Collections.Generic;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>Which object to show next, and from which side: those the service is not sure of.</summary>
    internal sealed class ObjectScanner
    {
        const double SureFrom = 0.6; // confidence of a decision that needs no more views

        readonly Dictionary<string, int> views = new Dictionary<string, int>();
        int session;
        int viewsEach;

        /// <summary>Whether no object is left to show, as of the last Next.</summary>
        public bool IsDone { get; private set; }

        /// <summary>Starts over when the link is new: a new session knows nothing.</summary>
        public void Follow(int nowSession, int nowViewsEach)
        {
            viewsEach = nowViewsEach;
            if (nowSession == session) return;
            session = nowSession;
            views.Clear();
            IsDone = false;
        }

        public bool Next(List<HapticObject> among, out HapticObject next, out int view)
        {
            for (int i = 0; i < among.Count; i++)
            {
                next = among[i];
                views.TryGetValue(next.ObjectId, out view);
                if (view >= viewsEach || IsSure(next, view)) continue;
                views[next.ObjectId] = view + 1;
                IsDone = false;
                return true;
            }
            next = null;
            view = 0;
            IsDone = true;
            return false;
        }

        /// <summary>The first view is always shown: its answer says what the name alone was good for.</summary>
        static bool IsSure(HapticObject shown, int view)
        {
            if (shown.StatedMaterial != null) return true;
            return view > 0 && shown.Material != null && shown.Source != Rung.Unknown && shown.Confidence >= SureFrom;
        }
    }
}
